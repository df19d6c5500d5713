// Reads the ROS graph on a thread of its own whenever it changes.
#pragma once

#include <rcl/guard_condition.h>
#include <rcl/wait.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>

#include "core/base/time.hpp"
#include "core/ports/ports.hpp"
#include "ros/entities/entity.hpp"
#include "ros/node/node.hpp"

namespace connect_bridge::ros {

// Thread: all calls from the loop's.
class GraphWatcher final : public Entity {
 public:
  // Two readings are at least `pause` apart, and at least ten times the duration of a reading, so
  // that a large graph that keeps changing uses at most a tenth of a core; three times if a reading
  // is asked for. `look` is called on the loop's thread as soon as something has changed, before it
  // is read, or when look_again() requested it.
  GraphWatcher(const Node& node, ReadyList& ready, Duration pause,
               std::function<void(bool changed)> look);
  ~GraphWatcher() override;

  // Calls `look`; returns the newest graph, if it was not returned yet.
  std::optional<Input> step(Batch& batch) override;
  // Reads again, and reports also if nothing has changed.
  void refresh();
  // Whether another process has a node of this name ("/fleet/talker"), by the endpoints of the
  // newest graph. Endpoints of bridges count for the bridge's own node, whatever their node's name
  // is.
  [[nodiscard]] bool has_node(const std::string& name);
  // The services (full names) whose servers are to be identified.
  void watch(std::set<std::string> services);
  // Requests a look after this time, or sooner if that was requested before.
  void look_again(Duration delay);

  [[nodiscard]] std::uint64_t readings() const { return readings_; }
  [[nodiscard]] Duration reading() const { return Duration{reading_ns_}; }

 private:
  using Clock = std::chrono::steady_clock;

  void run();
  // Waits for a change, a refresh, the stop, a look or the deadline; true if there is something to
  // read.
  bool wait(Clock::time_point deadline);
  // `if_asked`: when a reading is asked for, as a sample of an unknown publisher waits for it.
  void pause(Duration duration, Duration if_asked);
  // Marks the look that is due; returns when the next one will be.
  Clock::time_point next_look();
  void read();
  bool stopping();
  [[nodiscard]] bool wants_reading() const { return refresh_ || read_again_; }

  const Node& node_;
  const Duration pause_;
  const std::function<void(bool changed)> look_;
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
