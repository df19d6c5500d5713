// Endpoints by their numbers, which are never used again. Those that ended long ago are forgotten,
// so that a world may live for a day.
#pragma once

#include <cstddef>
#include <map>
#include <ranges>

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
  [[nodiscard]] std::size_t size() const { return all_.size(); }
  // In the order of their making.
  [[nodiscard]] auto all() const { return std::views::values(all_); }
  // Those whose id is at least `first`.
  [[nodiscard]] auto since(int first) const {
    return std::views::values(std::ranges::subrange(all_.lower_bound(first), all_.end()));
  }
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
