// The ROS graph as a value.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/base/time.hpp"
#include "core/ports/ports.hpp"
#include "ros/graph/service_reading.hpp"
#include "ros/node/node.hpp"

namespace connect_bridge::ros {

// To ask for the endpoints of a topic takes the middleware time in proportion to all endpoints, and
// it holds a lock meanwhile that the loop needs. So each reading has the topics of others' nodes,
// and those that had endpoints of others before; of the rest, which in a large graph are our own
// mirrors, each has only some, new names first, and the next one goes on there. Between long
// questions the lock is left to others for as long. Single-threaded, on any thread.
class GraphReading {
 public:
  static constexpr Duration kTimeForRest = std::chrono::milliseconds(20);

  // `time_for_rest`: of each reading; it has one of the rest whatever time that takes.
  explicit GraphReading(const Node& node, Duration time_for_rest = kTimeForRest)
      : node_(node), time_for_rest_(time_for_rest) {}

  // All topics with the endpoints of others, and all services with the servers of others; nullopt:
  // the middleware failed. The servers of `watched` services have their ids. `changed`: something
  // may have changed since the last one began. `between` is called again and again, as a large
  // graph takes hundreds of milliseconds, and is to leave the middleware to others for this time,
  // and to return for how long it did. It may call read_topic().
  std::optional<GraphChanged> read(
      const std::set<std::string>& watched, bool changed = true,
      const std::function<Duration(Duration rest)>& between = [](Duration) { return Duration{}; });
  // An endpoint's node may not be known yet; it becomes known soon, without a further event.
  [[nodiscard]] bool unknown_names() const { return unknown_names_; }  // in the last read()
  // Some topics were not read since the last change: another reading goes on with them.
  [[nodiscard]] bool unfinished() const { return changed_ || next_ < rest_.size(); }
  // For how long the last read() left the middleware to others.
  [[nodiscard]] Duration rested() const { return rested_; }

  // Reads one topic and replaces what `graph` has of it. False: the middleware failed, and `graph`
  // is as it was.
  bool read_topic(const std::string& topic, GraphChanged& graph);

 private:
  bool read_topics(BridgeParticipants& bridges, const std::function<void()>& between);
  bool ask_for_rest();
  bool read_rest(BridgeParticipants& bridges, const std::function<void()>& between);
  bool read_states(const std::string& topic, BridgeParticipants& bridges);
  void keep(const std::string& topic, std::vector<TopicState> states);

  const Node& node_;
  const Duration time_for_rest_;
  std::map<std::string, std::vector<TopicState>> topics_;  // with endpoints of others
  std::vector<std::string> rest_;  // the topics without, as far as was known
  std::size_t next_ = 0;           // of them, to be read
  bool changed_ = false;           // since the names of the rest were asked for
  BridgeParticipants bridges_;     // of the last read()
  Duration rested_{};
  bool unknown_names_ = false;
};

}  // namespace connect_bridge::ros
