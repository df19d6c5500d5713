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

// A question for the endpoints of a topic takes time in proportion to all endpoints. The middleware
// meanwhile holds a lock that the loop needs. So each reading covers the topics of others' nodes,
// and topics that had endpoints of others before. The rest, in a large graph mostly our own
// mirrors, is read in portions: new names first, and the next reading continues there. After a long
// question the lock is left free for as long. Single-threaded, on any thread.
class GraphReading {
 public:
  static constexpr Duration kTimeForRest = std::chrono::milliseconds(20);

  // `time_for_rest`: per reading. At least one topic of the rest is read, whatever that takes.
  explicit GraphReading(const Node& node, Duration time_for_rest = kTimeForRest)
      : node_(node), time_for_rest_(time_for_rest) {}

  // Reads all topics with the endpoints of others, and all services with the servers of others.
  // nullopt: the middleware failed. Servers of `watched` services have their ids. `changed`: the
  // graph may have changed since the last reading began. A large graph takes hundreds of
  // milliseconds, so `between` is called repeatedly: it leaves the middleware free for the given
  // time, returns how long it did, and may call read_topic().
  std::optional<GraphChanged> read(
      const std::set<std::string>& watched, bool changed = true,
      const std::function<Duration(Duration rest)>& between = [](Duration) { return Duration{}; });
  // Some endpoints have unknown nodes; these become known soon, without a further event.
  [[nodiscard]] bool unknown_names() const { return unknown_names_; }  // in the last read()
  // Some topics were not read since the last change: the next reading continues with them.
  [[nodiscard]] bool unfinished() const { return changed_ || next_ < rest_.size(); }
  // Total time of the last read() in which the middleware was left free.
  [[nodiscard]] Duration rested() const { return rested_; }

  // Reads one topic and replaces its states in `graph`. False: the middleware failed, and `graph`
  // is unchanged.
  bool read_topic(const std::string& topic, GraphChanged& graph);

 private:
  bool read_topics(BridgeParticipants& bridges, const std::function<void()>& between);
  bool ask_for_rest();
  bool read_rest(BridgeParticipants& bridges, const std::function<void()>& between);
  bool read_states(const std::string& topic, BridgeParticipants& bridges);
  void keep(const std::string& topic, std::vector<TopicState> states);

  const Node& node_;
  const Duration time_for_rest_;
  std::map<std::string, std::vector<TopicState>> topics_;  // topics with endpoints of others
  std::vector<std::string> rest_;  // known topics without endpoints of others
  std::size_t next_ = 0;           // index in rest_ of the next topic to be read
  bool changed_ = false;           // since the names of rest_ were read
  BridgeParticipants bridges_;     // result of the last read()
  Duration rested_{};
  bool unknown_names_ = false;
};

}  // namespace connect_bridge::ros
