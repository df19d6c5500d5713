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
#include "ros/graph/asked_topics.hpp"
#include "ros/graph/graph_reading.hpp"
#include "ros/graph/reading_pace.hpp"
#include "ros/node/node.hpp"

namespace connect_bridge::ros {

// All calls come from the loop's thread.
class GraphWatcher final : public Entity {
 public:
  // Two readings are at least `pause` apart, and follow ReadingPace. `look` is called on the loop's
  // thread as soon as something has changed, before it is read, or when look_again() requested it.
  GraphWatcher(const Node& node, ReadyList& ready, Duration pause,
               std::function<void(bool changed)> look);
  ~GraphWatcher() override;

  // Calls `look`; returns the newest graph, if it was not returned yet.
  std::optional<Input> step(Batch& batch) override;
  // Requests a reading, which is reported even without changes. A `topic` that is not empty is read
  // and reported at once, whatever reading or pause is under way.
  void refresh(const std::string& topic);
  // True if another process has a node of this name ("/fleet/talker"), by the endpoints of the
  // newest graph. Endpoints of bridges count for the bridge's own node, whatever node they belong
  // to.
  [[nodiscard]] bool has_node(const std::string& name);
  // Sets the services (full names) whose servers need ids.
  void watch(std::set<std::string> services);
  // Requests a look after this time; a request for an earlier time stays.
  void look_again(Duration delay);

  [[nodiscard]] std::uint64_t readings() const { return readings_; }
  [[nodiscard]] Duration reading_time() const { return Duration{reading_ns_}; }

 private:
  using Clock = std::chrono::steady_clock;

  void run();
  // Waits for a change, a refresh, the stop, a look or the deadline. True if a reading is needed.
  bool wait(Clock::time_point deadline);
  // Pauses, and serves requests meanwhile. `if_asked`: the pause if a reading is requested, because
  // a sample of an unknown publisher waits for it. Returns the idle time.
  Duration pause(Duration duration, Duration if_asked);
  // Between the questions of a reading: serves requests, and leaves the middleware free for `rest`,
  // but not for long. Returns the idle time.
  Duration leave(Duration rest);
  // Reads requested topics and marks a due look. Returns the time of the next one.
  Clock::time_point serve();
  std::optional<std::string> take_asked();
  // `changed`: the graph may have changed since the last reading.
  void read(bool changed);
  void read_topic(const std::string& topic);
  void tell(GraphChanged graph);
  bool stopping();
  [[nodiscard]] bool wants_reading() const { return refresh_ || read_again_; }

  const Node& node_;
  const Duration pause_;
  const std::function<void(bool changed)> look_;
  rcl_guard_condition_t poke_ = rcl_get_zero_initialized_guard_condition();
  rcl_wait_set_t wait_set_ = rcl_get_zero_initialized_wait_set();
  std::atomic<bool> refresh_{true};  // a reading is requested, and reported even without changes
  std::atomic<bool> read_again_{false};  // a reading is requested
  std::atomic<std::uint64_t> readings_{0};
  std::atomic<Duration::rep> reading_ns_{0};

  std::mutex mutex_;  // guards the members up to nodes_
  std::condition_variable poked_;
  bool stop_ = false;
  bool news_ = false;  // ends a pause: there is a new request
  Clock::time_point look_at_ = Clock::time_point::max();
  AskedTopics asked_;
  std::optional<GraphChanged> newest_;
  std::set<std::string> watched_;
  std::set<std::string> nodes_;  // names of others' nodes

  // Used by the watcher's thread only:
  GraphReading reading_;
  std::optional<GraphChanged> last_;
  std::set<std::string> answered_;  // topics that were read during the present reading
  ReadingPace pace_;
  int retries_ = 0;  // consecutive readings with unknown names or a failure
  bool incomplete_ = false;

  std::thread thread_;
};

}  // namespace connect_bridge::ros
