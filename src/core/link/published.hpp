// The samples that mirrors of latched origins had published when their link ended.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "core/base/budget.hpp"
#include "core/base/ids.hpp"

namespace connect_bridge {

// Belongs to a link. A mirror that is made when the link is back continues there: subscribers that
// were here before get each sample once. Single-threaded.
class Published {
 public:
  using Origin = std::pair<std::pair<std::string, std::string>, Gid>;  // local name and type

  // Limits of a link: origins, and subscribers of each. Beyond them samples are published again.
  static constexpr std::size_t kOriginsMax = 1024;
  static constexpr std::size_t kSubscribersMax = 64;

  struct Samples {
    std::uint64_t number = 0;        // the largest; 0: none
    std::set<Gid> subscribers = {};  // who got them
  };

  void note(const Origin& origin, Samples samples, Budget& memory) {
    const std::uint64_t bytes = kEntryBytes + samples.subscribers.size() * kSubscriberBytes +
                                origin.first.first.size() + origin.first.second.size();
    if (samples.subscribers.empty() || samples.subscribers.size() > kSubscribersMax ||
        entries_.size() >= kOriginsMax || bytes > memory.room())
      return;
    entries_[origin] = {std::move(samples), memory.hold(bytes)};
  }
  // What was noted of the origin, which is forgotten here.
  Samples take(const Origin& origin) {
    auto entry = entries_.extract(origin);
    return entry ? std::move(entry.mapped().samples) : Samples{};
  }
  void clear() { entries_.clear(); }
  [[nodiscard]] bool empty() const { return entries_.empty(); }

 private:
  static constexpr std::uint64_t kEntryBytes = 240;  // memory of one entry without names
  static constexpr std::uint64_t kSubscriberBytes = 80;

  struct Entry {
    Samples samples;
    Budget::Hold held;
  };
  std::map<Origin, Entry> entries_;
};

}  // namespace connect_bridge
