#include "ros/services/server_sight.hpp"

namespace connect_bridge::ros {

bool ServerSight::look(bool reached, bool in_graph, Time now) {
  if (reached) {
    missing_since_.reset();
  } else if (!missing_since_) {
    missing_since_ = now;
  }
  patience_ = in_graph ? kPatienceInGraph : kPatience;
  const bool ready = !missing_since_ || (ready_ && now - *missing_since_ < patience_);
  const bool changed = ready != ready_;
  ready_ = ready;
  return changed;
}

std::optional<Duration> ServerSight::next_look() const {
  if (!ready_ || !missing_since_) return std::nullopt;
  return patience_ / 3;
}

}  // namespace connect_bridge::ros
