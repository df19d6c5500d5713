// Reads the ROS graph on a thread of its own whenever it changes.
#pragma once

#include <rcl/guard_condition.h>
#include <rcl/wait.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "core/base/time.hpp"
#include "core/ports/ports.hpp"
#include "ros/node/node.hpp"

namespace connect_bridge::ros {

// Participants of the graph in which bridges live, by the beginning of their endpoints' ids.
// Whatever nodes they have, their endpoints are the bridge's. Empty where ids do not tell
// (distro.hpp).
struct BridgeParticipants {
  struct NodeName {
    std::string name_space, name;
  };
  std::map<Gid, NodeName> others;  // bridges, which publish claims
  std::set<Gid>
      namesakes;  // of our node: another process of our name, or what is left of a killed one

  [[nodiscard]] bool empty() const { return others.empty() && namesakes.empty(); }
};

// All topics with the endpoints of others, and all services with the servers of others; nullopt:
// the middleware failed. The servers of `watched` services have their ids. `unknown_names` tells
// whether an endpoint's node is not known yet, which ends soon without a further event.
std::optional<GraphChanged> read_graph(const Node& node, const std::set<std::string>& watched,
                                       bool& unknown_names);
// The second half of it.
std::optional<std::vector<ServiceState>> read_services(const Node& node,
                                                       const std::set<std::string>& watched,
                                                       const BridgeParticipants& bridges);

enum class GraphNews {
  kTouched,  // something has changed; nothing was read yet
  kRead,     // take() has a graph
  kLook,     // the time of look_again() has come
};

// Thread: all calls from the loop's.
class GraphWatcher {
 public:
  // `news` is called on the watcher's thread. Two readings are at least `pause` apart, and ten
  // times as long as a reading takes, so that a large graph that keeps changing costs at most a
  // tenth of a core.
  GraphWatcher(const Node& node, Duration pause, std::function<void(GraphNews)> news);
  ~GraphWatcher();
  GraphWatcher(const GraphWatcher&) = delete;
  GraphWatcher& operator=(const GraphWatcher&) = delete;

  // Reads again, and reports also if nothing has changed.
  void refresh();
  // The newest graph, if it was not taken yet.
  std::optional<GraphChanged> take();
  // Whether others have a node of this name ("/fleet/talker"), going by the endpoints of the newest
  // graph. What bridges have is theirs, whatever its name.
  [[nodiscard]] bool has_node(const std::string& name);
  // The services (full names) of which it matters which server there is.
  void watch(std::set<std::string> services);
  // Calls for a look after this time, or sooner if that was asked for before.
  void look_again(Duration delay);

  [[nodiscard]] std::uint64_t readings() const { return readings_; }
  [[nodiscard]] Duration reading() const { return Duration{reading_ns_}; }

 private:
  using Clock = std::chrono::steady_clock;

  void run();
  // Waits for a change, a refresh, the stop, a look or the deadline; true if there is something to
  // read.
  bool wait(Clock::time_point deadline);
  void pause(Duration duration);
  // Calls for the look that is due; returns when the next one will be.
  Clock::time_point look();
  void read();
  bool stopping();
  [[nodiscard]] bool wants_reading() const { return refresh_ || read_again_; }

  const Node& node_;
  const Duration pause_;
  const std::function<void(GraphNews)> news_;
  rcl_guard_condition_t poke_ = rcl_get_zero_initialized_guard_condition();
  rcl_wait_set_t wait_set_ = rcl_get_zero_initialized_wait_set();
  std::atomic<bool> refresh_{true};      // a reading is wanted, and reported also without change
  std::atomic<bool> read_again_{false};  // a reading is wanted
  std::atomic<std::uint64_t> readings_{0};
  std::atomic<Duration::rep> reading_ns_{0};

  std::mutex mutex_;  // guards what follows
  std::condition_variable poked_;
  bool stop_ = false;
  Clock::time_point look_at_ = Clock::time_point::max();
  std::optional<GraphChanged> newest_;
  std::set<std::string> watched_;
  std::set<std::string> nodes_;  // others' names

  // Of the watcher's thread:
  GraphChanged last_;
  int retries_ = 0;  // readings in a row with unknown names or a failure
  bool incomplete_ = false;

  std::thread thread_;
};

}  // namespace connect_bridge::ros
