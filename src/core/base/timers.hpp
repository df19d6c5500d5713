// Deadlines of many things, and the earliest of them.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <utility>

#include "core/base/time.hpp"

namespace connect_bridge {

// A table of deadlines. The caller that sets one gets a Timer, which takes the deadline out of the
// table when it is destroyed or set again: a destroyed owner is never called. Equal deadlines come
// in the order in which they were set. The table outlives its timers. Single-threaded.
template <class Value>
class Timers {
  using Key = std::pair<TimePoint, std::uint64_t>;  // the second makes it unique

 public:
  class Timer {
   public:
    Timer() = default;
    Timer(Timer&& other) noexcept
        : table_(std::exchange(other.table_, nullptr)), key_(other.key_) {}
    Timer& operator=(Timer&& other) noexcept {
      if (this == &other) return *this;
      cancel();
      table_ = std::exchange(other.table_, nullptr);
      key_ = other.key_;
      return *this;
    }
    ~Timer() { cancel(); }

    void cancel() {
      if (table_) table_->entries_.erase(key_);
      table_ = nullptr;
    }
    // Set, and not yet due or cancelled. Still true for a deadline that take_due() has just given.
    explicit operator bool() const { return table_ != nullptr; }
    [[nodiscard]] TimePoint at() const { return key_.first; }

   private:
    friend class Timers;
    Timer(Timers* table, Key key) : table_(table), key_(key) {}

    Timers* table_ = nullptr;
    Key key_{};
  };

  // Sets deadlines for one value; a part of an owner sets the owner's with it.
  class Of {
   public:
    Of(Timers& table, Value value) : table_(&table), value_(std::move(value)) {}
    [[nodiscard]] Timer set(TimePoint at) const { return table_->set(at, value_); }

   private:
    Timers* table_;
    Value value_;
  };

  Timers() = default;
  Timers(const Timers&) = delete;
  Timers& operator=(const Timers&) = delete;

  [[nodiscard]] Timer set(TimePoint at, Value value) {
    const Key key{at, ++last_};
    entries_.emplace(key, std::move(value));
    return Timer(this, key);
  }
  // Takes the earliest deadline that has been reached out of the table.
  std::optional<Value> take_due(TimePoint now) {
    if (entries_.empty() || entries_.begin()->first.first > now) return std::nullopt;
    Value value = std::move(entries_.begin()->second);
    entries_.erase(entries_.begin());
    return value;
  }
  [[nodiscard]] std::optional<TimePoint> deadline() const {
    if (entries_.empty()) return std::nullopt;
    return entries_.begin()->first.first;
  }

 private:
  std::map<Key, Value> entries_;
  std::uint64_t last_ = 0;
};

// The earlier of two deadlines; one that is not set does not count.
inline std::optional<TimePoint> earliest(std::optional<TimePoint> a, std::optional<TimePoint> b) {
  if (!a || !b) return a ? a : b;
  return *a < *b ? a : b;
}

}  // namespace connect_bridge
