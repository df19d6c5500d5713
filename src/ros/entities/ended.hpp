// Entities that have ended, until the middleware has taken them out of the graph.
#pragma once

#include <chrono>
#include <deque>
#include <memory>
#include <string>
#include <utility>

#include "ros/entities/entity.hpp"

namespace connect_bridge::ros {

// To end one takes the middleware some 0.1 ms, and when a link is lost there can be thousands:
// they go a few at a time, and others get their turns in between. Thread: the loop's.
class Ended {
 public:
  // How long free_some() takes, and what it had begun by then.
  static constexpr auto kTurn = std::chrono::milliseconds(2);

  // It reports nothing any more.
  void add(std::unique_ptr<Entity> entity) {
    entity->mute();
    entities_.push_back(std::move(entity));
  }
  // Those of one topic or service go at once. Returns whether there were any.
  bool free(const std::string& name) {
    return std::erase_if(entities_, [&](const auto& entity) { return entity->name() == name; }) > 0;
  }
  // Returns whether some are left.
  bool free_some() {
    if (entities_.empty()) return false;
    const auto end = std::chrono::steady_clock::now() + kTurn;
    while (!entities_.empty() && std::chrono::steady_clock::now() < end) entities_.pop_front();
    return !entities_.empty();
  }

 private:
  std::deque<std::unique_ptr<Entity>> entities_;
};

}  // namespace connect_bridge::ros
