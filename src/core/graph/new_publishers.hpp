// Publishers that the local graph has just shown, beside another bridge.
#pragma once

#include <optional>
#include <unordered_map>
#include <utility>
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
  // Takes those that are too new out of the picture. `misses`: bridges that may be in this graph
  // have not been heard (Claims::misses).
  void hold(GraphChanged& graph, bool misses, const Now& now);
  // What was held for long enough, as topics with one publisher each.
  [[nodiscard]] std::vector<TopicState> take_due(const Now& now);
  [[nodiscard]] std::optional<TimePoint> deadline() const;
  // Their ids: they are in the graph, whatever they are.
  [[nodiscard]] std::vector<Gid> held() const;

 private:
  struct Held {
    TimePoint until;
    TopicState topic;
  };
  std::optional<TimePoint> since_;  // of the first picture
  // The publishers of the last picture, and when one that does not count yet was seen first.
  std::unordered_map<Gid, std::optional<TimePoint>> seen_;
  std::vector<Held> held_;
};

}  // namespace connect_bridge
