// Messages that a rule's rate refused and that may leave later.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "core/base/budget.hpp"
#include "core/base/ids.hpp"
#include "core/base/timers.hpp"

namespace connect_bridge {

// A peer may cause so many held messages that come due at one time that they would stop the loop.
// So many of all topics leave in one step.
inline constexpr std::size_t kHeldPerStep = 64;

// Keeps for each key of a publisher's rate (RateLimit::key: mostly a state) the newest message that
// a rate limit has refused, until its time comes or another message of that key passes. So a rate
// limit does not lose a publisher's last message, which may say "stop", unless its owner drops it.
// `Owner`: who is woken when the time of a message has come. Single-threaded.
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
    entries_.try_emplace(key, std::move(message), memory_.hold(all), at);
    order_.emplace(at, key);
    wake();
    return older;
  }
  // The next message whose time has come; it takes one of `left`. If none is left the owner is
  // woken again at once, behind the others that are due.
  std::optional<Message> take_due(TimePoint now, std::size_t& left) {
    if (order_.empty() || order_.begin()->first > now) return std::nullopt;
    if (left == 0) {
      wakes_ = timers_.set(now);
      return std::nullopt;
    }
    --left;
    return take(entries_.find(order_.begin()->second));
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
    Entry(Message held, Budget::Hold counted, TimePoint at)
        : message(std::move(held)), bytes(std::move(counted)), leaves(at) {}
    Message message;
    Budget::Hold bytes;
    TimePoint leaves;
  };
  std::optional<Message> take(typename std::map<Key, Entry>::iterator at) {
    if (at == entries_.end()) return std::nullopt;
    std::optional<Message> message(std::move(at->second.message));
    order_.erase({at->second.leaves, at->first});
    entries_.erase(at);
    wake();
    return message;
  }
  void wake() {
    wakes_ = order_.empty() ? typename Timers<Owner>::Timer() : timers_.set(order_.begin()->first);
  }

  Budget& memory_;
  typename Timers<Owner>::Of timers_;
  std::map<Key, Entry> entries_;
  std::set<std::pair<TimePoint, Key>> order_;  // of the entries, as they leave
  typename Timers<Owner>::Timer wakes_;
};

}  // namespace connect_bridge
