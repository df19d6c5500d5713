// Publishers that the local graph has just shown, beside another bridge.
#pragma once

#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "core/base/time.hpp"
#include "core/ports/inputs.hpp"

namespace connect_bridge {

// A publisher may be another bridge's mirror under another node's name, and the graph may show it
// before its bridge's claim names it. If it were exported until then, what it publishes would come
// back to where it was published. So beside another bridge a publisher counts only a moment after
// it was seen first; what it publishes meanwhile is parked (core/topics/exported_topic.hpp).
// Where ids show which process an endpoint belongs to, nothing waits. Single-threaded.
class NewPublishers {
 public:
  // Takes those that are too new out of the picture.
  void hold(GraphChanged& graph, const Now& now);
  // What was held for long enough, as topics with one publisher each.
  struct Due {
    std::vector<TopicState> topics;
    std::unordered_set<Gid> left;  // those of them that are not in the graph any longer
  };
  [[nodiscard]] Due take_due(const Now& now);
  [[nodiscard]] std::optional<TimePoint> deadline() const;
  // Their ids: they are in the graph, or were just now, whatever they are.
  [[nodiscard]] std::vector<Gid> held() const;

 private:
  // One that leaves meanwhile is held all the same: what it has published is still to cross.
  struct Held {
    TimePoint until;
    TopicState topic;
    bool left = false;
    [[nodiscard]] const Gid& gid() const { return topic.publishers.front().gid; }
  };
  // The publishers of the last picture, and when one that does not count yet was seen first.
  std::unordered_map<Gid, std::optional<TimePoint>> seen_;
  std::vector<Held> held_;
};

}  // namespace connect_bridge
