// The ROS graph as a value.
#pragma once

#include <functional>
#include <optional>
#include <set>
#include <string>

#include "core/ports/ports.hpp"
#include "ros/graph/service_reading.hpp"
#include "ros/node/node.hpp"

namespace connect_bridge::ros {

// Single-threaded, on any thread.
class GraphReading {
 public:
  explicit GraphReading(const Node& node) : node_(node) {}

  // All topics with the endpoints of others, and all services with the servers of others; nullopt:
  // the middleware failed. The servers of `watched` services have their ids. `between` is called
  // again and again: a large graph takes hundreds of milliseconds. It may call read_topic().
  std::optional<GraphChanged> read(
      const std::set<std::string>& watched, const std::function<void()>& between = [] {});
  // An endpoint's node may not be known yet; it becomes known soon, without a further event.
  [[nodiscard]] bool unknown_names() const { return unknown_names_; }  // in the last read()

  // Reads one topic and replaces what `graph` has of it. False: the middleware failed, and `graph`
  // is as it was.
  bool read_topic(const std::string& topic, GraphChanged& graph);

 private:
  std::optional<std::vector<TopicState>> read_topics(BridgeParticipants& bridges,
                                                     const std::function<void()>& between);

  const Node& node_;
  BridgeParticipants bridges_;  // of the last read()
  bool unknown_names_ = false;
};

}  // namespace connect_bridge::ros
