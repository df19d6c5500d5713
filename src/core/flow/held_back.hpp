// Messages that a rule's rate refused and that may leave later.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <utility>

#include "core/base/budget.hpp"
#include "core/base/ids.hpp"
#include "core/base/timers.hpp"

namespace connect_bridge {

// Keeps for each publisher the newest message that a rate limit has refused, until its time comes
// or another message of that publisher passes. So a rate limit never loses a publisher's last
// message, which may say "stop". Single-threaded.
template <class Message>
class HeldBack {
 public:
  // What is held counts in `memory`, which outlives this.
  explicit HeldBack(Budget& memory) : memory_(memory) {}

  // Holds the message until `at`, instead of an older one of the publisher. Returns the message
  // that is lost: the older one, or, where there is no room for it, this one.
  std::optional<Message> hold(OriginId origin, Message message, std::size_t bytes, TimePoint at) {
    if (bytes > memory_.room()) return message;
    auto older = take(origin);
    entries_.try_emplace(origin, std::move(message), memory_.hold(bytes), timers_.set(at, origin));
    return older;
  }
  // The next message whose time has come.
  std::optional<Message> take_due(TimePoint now) {
    const auto due = timers_.take_due(now);
    return due ? take(entries_.find(*due)) : std::nullopt;
  }
  // The next message (of this publisher), whether or not its time has come.
  std::optional<Message> take() { return take(entries_.begin()); }
  std::optional<Message> take(OriginId origin) { return take(entries_.find(origin)); }
  [[nodiscard]] std::optional<TimePoint> deadline() const { return timers_.deadline(); }
  [[nodiscard]] bool empty() const { return entries_.empty(); }
  [[nodiscard]] std::size_t size() const { return entries_.size(); }

 private:
  struct Entry {
    Entry(Message held, Budget::Hold counted, typename Timers<OriginId>::Timer at)
        : message(std::move(held)), bytes(std::move(counted)), leaves(std::move(at)) {}
    Message message;
    Budget::Hold bytes;
    typename Timers<OriginId>::Timer leaves;
  };
  std::optional<Message> take(typename std::map<OriginId, Entry>::iterator at) {
    if (at == entries_.end()) return std::nullopt;
    std::optional<Message> message(std::move(at->second.message));
    entries_.erase(at);
    return message;
  }

  Budget& memory_;
  Timers<OriginId> timers_;
  std::map<OriginId, Entry> entries_;
};

}  // namespace connect_bridge
