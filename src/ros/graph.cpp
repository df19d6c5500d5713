#include "ros/graph.hpp"

#include <rcl/node.h>

#include <chrono>

#include "ros/graph_compare.hpp"
#include "ros/rcl_result.hpp"

namespace connect_bridge::ros {
namespace {

// A node's name reaches us some time after its endpoints. Re-reading helps for a while; after that
// the endpoint belongs to a program that is not ROS.
constexpr int kRetriesMax = 6;

Duration retry_delay(int retries) {
  return std::chrono::milliseconds(25) * (1 << retries);
}

}  // namespace

GraphWatcher::GraphWatcher(const Node& node, Duration pause, std::function<void()> changed)
    : node_(node), pause_(pause), changed_(std::move(changed)) {
  auto* context = node.context();
  require_ok(rcl_guard_condition_init(&poke_, context, rcl_guard_condition_get_default_options()),
             "cannot watch the graph");
  const rcl_ret_t made =
      rcl_wait_set_init(&wait_set_, 0, 2, 0, 0, 0, 0, context, rcl_get_default_allocator());
  if (made != RCL_RET_OK) {
    const auto text = error_text("cannot watch the graph", made);
    ignore_error(rcl_guard_condition_fini(&poke_));
    throw RosError(text);
  }
  thread_ = std::thread([this] { run(); });
}

GraphWatcher::~GraphWatcher() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  stopping_.notify_all();
  ignore_error(rcl_trigger_guard_condition(&poke_));
  thread_.join();
  ignore_error(rcl_wait_set_fini(&wait_set_));
  ignore_error(rcl_guard_condition_fini(&poke_));
}

void GraphWatcher::refresh() {
  refresh_ = true;
  ignore_error(rcl_trigger_guard_condition(&poke_));
}

std::optional<GraphChanged> GraphWatcher::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(newest_, std::nullopt);
}

void GraphWatcher::run() {
  bool due = true;
  while (true) {
    if (due) {
      const auto begin = std::chrono::steady_clock::now();
      read();
      const Duration took = std::chrono::steady_clock::now() - begin;
      reading_ns_ = took.count();
      ++readings_;
      pause(std::max(pause_, took * 10));
    }
    {
      const std::lock_guard lock(mutex_);
      if (stop_) return;
    }
    const bool again = incomplete_ && retries_ < kRetriesMax;
    due = wait(again ? retry_delay(retries_) : kForever) || again;
  }
}

bool GraphWatcher::wait(Duration timeout) {
  // A guard condition that was triggered before it is added here still ends the wait.
  const auto* changes = rcl_node_get_graph_guard_condition(node_.handle());
  std::size_t place = 0;
  const bool ready = ignore_error(rcl_wait_set_clear(&wait_set_)) &&
                     ignore_error(rcl_wait_set_add_guard_condition(&wait_set_, changes, &place)) &&
                     ignore_error(rcl_wait_set_add_guard_condition(&wait_set_, &poke_, nullptr));
  if (!ready) {
    pause(std::chrono::seconds(1));
    return true;
  }
  const rcl_ret_t result = rcl_wait(&wait_set_, timeout == kForever ? -1 : timeout.count());
  if (result == RCL_RET_TIMEOUT) return !ignore_error(result) && refresh_;
  if (!ignore_error(result)) {
    // The context was shut down, or the middleware failed: do not spin.
    pause(std::chrono::milliseconds(200));
    return false;
  }
  return wait_set_.guard_conditions[place] != nullptr || refresh_;
}

void GraphWatcher::pause(Duration duration) {
  std::unique_lock lock(mutex_);
  stopping_.wait_for(lock, duration, [this] { return stop_; });
}

void GraphWatcher::read() {
  const bool asked = refresh_.exchange(false);
  bool unknown_names = false;
  auto topics = read_graph(node_, unknown_names);
  incomplete_ = unknown_names || !topics;
  retries_ = incomplete_ ? retries_ + 1 : 0;
  if (!topics) {
    if (asked) refresh_ = true;
    return;
  }
  if (!asked && same_topics(*topics, last_)) return;
  last_ = *topics;
  {
    const std::lock_guard lock(mutex_);
    newest_ = GraphChanged{std::move(*topics)};
  }
  changed_();
}

}  // namespace connect_bridge::ros
