// Messages that a rule's rate refused and that may leave later.
#pragma once

#include <algorithm>
#include <cstddef>
#include <map>
#include <optional>
#include <utility>

#include "core/base/budget.hpp"
#include "core/base/ids.hpp"
#include "core/base/timers.hpp"

namespace connect_bridge {

// Keeps for each key of a publisher's rate (RateLimit::key: mostly a state) the newest message that
// a rate limit has refused, until its time comes or another message of that key passes. So a rate
// limit never loses a publisher's last message, which may say "stop". `Owner`: who is woken when
// the time of a message has come. Single-threaded.
template <class Message, class Owner>
class HeldBack {
 public:
  // Held messages count in `memory`, which outlives this.
  HeldBack(Budget& memory, typename Timers<Owner>::Of timers) : memory_(memory), timers_(timers) {}

  // A publisher, and a key of its rate.
  using Key = std::pair<OriginId, std::uint64_t>;
  static constexpr std::size_t kEntryBytes = 256;  // memory of each entry, without the payload

  // Holds the message until `at`, instead of an older one of the key. Returns the message that is
  // lost: the older one, or, where there is no room for it, this one.
  std::optional<Message> hold(const Key& key, Message message, std::size_t bytes, TimePoint at) {
    static_assert(sizeof(Entry) <= kEntryBytes);
    const std::size_t all = kEntryBytes + bytes;
    if (all > memory_.room()) return message;
    auto older = take(key);
    entries_.try_emplace(key, std::move(message), memory_.hold(all), timers_.set(at));
    return older;
  }
  // The next message whose time has come.
  std::optional<Message> take_due(TimePoint now) {
    const auto first = std::min_element(
        entries_.begin(), entries_.end(),
        [](const auto& a, const auto& b) { return a.second.leaves.at() < b.second.leaves.at(); });
    const bool due = first != entries_.end() && first->second.leaves.at() <= now;
    return due ? take(first) : std::nullopt;
  }
  // The next message (of this key, of this publisher), whether or not its time has come.
  std::optional<Message> take() { return take(entries_.begin()); }
  std::optional<Message> take(const Key& key) { return take(entries_.find(key)); }
  std::optional<Message> take(OriginId origin) {
    const auto first = entries_.lower_bound({origin, 0});
    return first != entries_.end() && first->first.first == origin ? take(first) : std::nullopt;
  }
  [[nodiscard]] bool empty() const { return entries_.empty(); }
  [[nodiscard]] std::size_t size() const { return entries_.size(); }

 private:
  struct Entry {
    Entry(Message held, Budget::Hold counted, typename Timers<Owner>::Timer at)
        : message(std::move(held)), bytes(std::move(counted)), leaves(std::move(at)) {}
    Message message;
    Budget::Hold bytes;
    typename Timers<Owner>::Timer leaves;
  };
  std::optional<Message> take(typename std::map<Key, Entry>::iterator at) {
    if (at == entries_.end()) return std::nullopt;
    std::optional<Message> message(std::move(at->second.message));
    entries_.erase(at);
    return message;
  }

  Budget& memory_;
  typename Timers<Owner>::Of timers_;
  std::map<Key, Entry> entries_;
};

}  // namespace connect_bridge
