// Endpoints by their numbers, which are never used again. Those that ended long ago are forgotten,
// so that a world may live for a day.
#pragma once

#include <algorithm>
#include <map>

#include "core/base/time.hpp"

namespace connect_bridge::sim {

// T has the members id, alive and destroyed. References stay valid until T is forgotten.
template <class T>
class Roster {
 public:
  T& add() {
    T& made = all_[made_];
    made.id = made_++;
    return made;
  }
  T& operator[](int id) { return all_.at(id); }
  const T& operator[](int id) const { return all_.at(id); }
  // How many there ever were: the next one's id.
  [[nodiscard]] int made() const { return made_; }
  // Of those whose id is at least `first`.
  template <class Predicate>
  [[nodiscard]] bool any(Predicate&& is_one, int first = 0) const {
    return std::any_of(all_.lower_bound(first), all_.end(),
                       [&](const auto& entry) { return is_one(entry.second); });
  }
  // In the order of their making.
  class Iterator {
   public:
    explicit Iterator(typename std::map<int, T>::const_iterator at) : at_(at) {}
    const T& operator*() const { return at_->second; }
    Iterator& operator++() {
      ++at_;
      return *this;
    }
    bool operator==(const Iterator&) const = default;

   private:
    typename std::map<int, T>::const_iterator at_;
  };
  [[nodiscard]] Iterator begin() const { return Iterator(all_.begin()); }
  [[nodiscard]] Iterator end() const { return Iterator(all_.end()); }
  // What ended before.
  void forget(TimePoint before) {
    std::erase_if(all_, [&](const auto& entry) {
      return !entry.second.alive && entry.second.destroyed < before;
    });
  }
  [[nodiscard]] bool knows(int id) const { return all_.contains(id); }

 private:
  std::map<int, T> all_;
  int made_ = 0;
};

}  // namespace connect_bridge::sim
