// Reads the ROS graph on a thread of its own whenever it changes.
#pragma once

#include <rcl/guard_condition.h>
#include <rcl/wait.h>

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "core/base/time.hpp"
#include "core/side/ports.hpp"
#include "ros/node.hpp"

namespace connect_bridge::ros {

// All topics with the endpoints of others; nullopt: the middleware failed. `unknown_names` tells
// whether an endpoint's node is not known yet, which ends soon without a further event.
std::optional<std::vector<TopicState>> read_graph(const Node& node, bool& unknown_names);

// Thread: all calls from the loop's.
class GraphWatcher {
 public:
  // `changed` is called on the watcher's thread; take() then has the graph. Two readings are at
  // least `pause` apart, and ten times as long as a reading takes, so that a large graph that keeps
  // changing costs at most a tenth of a core.
  GraphWatcher(const Node& node, Duration pause, std::function<void()> changed);
  ~GraphWatcher();
  GraphWatcher(const GraphWatcher&) = delete;
  GraphWatcher& operator=(const GraphWatcher&) = delete;

  // Reads again, and reports also if nothing has changed.
  void refresh();
  // The newest graph, if it was not taken yet.
  std::optional<GraphChanged> take();

  [[nodiscard]] std::uint64_t readings() const { return readings_; }
  [[nodiscard]] Duration reading() const { return Duration{reading_ns_}; }

 private:
  void run();
  // Waits for a change, a refresh, the stop, or the timeout; true if there is something to read.
  bool wait(Duration timeout);
  void pause(Duration duration);
  void read();

  const Node& node_;
  const Duration pause_;
  const std::function<void()> changed_;
  rcl_guard_condition_t poke_ = rcl_get_zero_initialized_guard_condition();
  rcl_wait_set_t wait_set_ = rcl_get_zero_initialized_wait_set();
  std::atomic<bool> refresh_{true};
  std::atomic<std::uint64_t> readings_{0};
  std::atomic<Duration::rep> reading_ns_{0};

  std::mutex mutex_;  // guards stop_ and newest_
  std::condition_variable stopping_;
  bool stop_ = false;
  std::optional<GraphChanged> newest_;

  // Of the watcher's thread:
  std::vector<TopicState> last_;
  int retries_ = 0;  // readings in a row with unknown names or a failure
  bool incomplete_ = false;

  std::thread thread_;
};

}  // namespace connect_bridge::ros
