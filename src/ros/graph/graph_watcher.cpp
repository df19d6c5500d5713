#include "ros/graph/graph_watcher.hpp"

#include <rcl/node.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "core/graph/graph_view.hpp"
#include "ros/rcl/rcl_result.hpp"

namespace connect_bridge::ros {
namespace {

// A node's name arrives some time after its endpoints, so the graph is read again a few times.
// After that the endpoint counts as one of a program without ROS.
constexpr int kRetriesMax = 6;
// A question also seems long while the machine sleeps, or while other threads hold the lock.
constexpr Duration kLeaveMax = std::chrono::milliseconds(20);

Duration retry_delay(int retries) {
  return std::chrono::milliseconds(25) * (1 << retries);
}

std::set<std::string> nodes_of(const GraphChanged& graph) {
  std::set<std::string> nodes;
  for (const TopicState& topic : graph.topics) {
    for (const Endpoint& endpoint : topic.publishers) nodes.insert(node_of(endpoint));
    for (const Endpoint& endpoint : topic.subscribers) nodes.insert(node_of(endpoint));
  }
  for (const ServiceState& service : graph.services) {
    for (const Server& server : service.servers) nodes.insert(node_of(server));
  }
  return nodes;
}

}  // namespace

GraphWatcher::GraphWatcher(const Node& node, ReadyList& ready, Duration pause,
                           std::function<void(bool changed)> look)
    : Entity(ready, kReadyMessage | kReadyChanged | kReadyLook),
      node_(node),
      pause_(pause),
      look_(std::move(look)),
      reading_(node) {
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
  poked_.notify_all();
  ignore_error(rcl_trigger_guard_condition(&poke_));
  thread_.join();
  ignore_error(rcl_wait_set_fini(&wait_set_));
  ignore_error(rcl_guard_condition_fini(&poke_));
}

void GraphWatcher::refresh(const std::string& topic) {
  {
    const std::lock_guard lock(mutex_);
    refresh_ = true;
    if (!topic.empty()) asked_.ask(topic, Clock::now());
    news_ = true;
  }
  poked_.notify_all();
  ignore_error(rcl_trigger_guard_condition(&poke_));
}

std::optional<Input> GraphWatcher::step(Batch&) {
  const bool changed = has_to(kReadyChanged);
  done(~0U);
  look_(changed);
  const std::lock_guard lock(mutex_);
  if (!newest_) return std::nullopt;
  return std::move(*std::exchange(newest_, std::nullopt));
}

bool GraphWatcher::has_node(const std::string& name) {
  const std::lock_guard lock(mutex_);
  return nodes_.contains(name);
}

void GraphWatcher::watch(std::set<std::string> services) {
  {
    const std::lock_guard lock(mutex_);
    watched_ = std::move(services);
  }
  read_again_ = true;
  ignore_error(rcl_trigger_guard_condition(&poke_));
}

void GraphWatcher::look_again(Duration delay) {
  {
    const std::lock_guard lock(mutex_);
    const auto at = Clock::now() + delay;
    if (at >= look_at_) return;
    look_at_ = at;
    news_ = true;
  }
  poked_.notify_all();
  ignore_error(rcl_trigger_guard_condition(&poke_));
}

void GraphWatcher::run() {
  bool due = true, changed = true;
  while (true) {
    if (due) {
      ReadyList::mark(slot(), kReadyChanged);
      const auto begin = Clock::now();
      read(changed);
      const Duration took = Clock::now() - begin - reading_.rested();
      reading_ns_ = took.count();
      ++readings_;
      const auto rest = pace_.after(took, Clock::now());
      pause(std::max(pause_, rest.usual), std::max(pause_, rest.if_asked));
    }
    if (stopping()) return;
    const bool again = incomplete_ && retries_ < kRetriesMax;
    const auto again_at = reading_.unfinished() ? Clock::now()
                          : again               ? Clock::now() + retry_delay(retries_)
                                                : Clock::time_point::max();
    do {
      changed = wait(std::min(again_at, serve()));
      due = changed || Clock::now() >= again_at;
    } while (!due && !stopping());
  }
}

bool GraphWatcher::stopping() {
  const std::lock_guard lock(mutex_);
  return stop_;
}

Duration GraphWatcher::leave(Duration rest) {
  serve();
  rest = std::min(rest, kLeaveMax);
  return pause(rest, rest);
}

GraphWatcher::Clock::time_point GraphWatcher::serve() {
  while (const auto topic = take_asked()) read_topic(*topic);
  bool look = false;
  Clock::time_point next;
  {
    const std::lock_guard lock(mutex_);
    if (look_at_ <= Clock::now()) {
      look_at_ = Clock::time_point::max();
      look = true;
    }
    next = std::min(look_at_, asked_.deadline().value_or(Clock::time_point::max()));
  }
  if (look) ReadyList::mark(slot(), kReadyLook);
  return next;
}

std::optional<std::string> GraphWatcher::take_asked() {
  const std::lock_guard lock(mutex_);
  return asked_.take_due(Clock::now());
}

bool GraphWatcher::wait(Clock::time_point deadline) {
  // A guard condition that was triggered before this still ends the wait.
  const auto* changes = rcl_node_get_graph_guard_condition(node_.handle());
  std::size_t place = 0;
  const bool ready = ignore_error(rcl_wait_set_clear(&wait_set_)) &&
                     ignore_error(rcl_wait_set_add_guard_condition(&wait_set_, changes, &place)) &&
                     ignore_error(rcl_wait_set_add_guard_condition(&wait_set_, &poke_, nullptr));
  if (!ready) {
    pause(std::chrono::seconds(1), std::chrono::seconds(1));
    return true;
  }
  const Duration left = std::max(Duration{0}, Duration{deadline - Clock::now()});
  const bool forever = deadline == Clock::time_point::max();
  const rcl_ret_t result = rcl_wait(&wait_set_, forever ? -1 : left.count());
  if (result == RCL_RET_TIMEOUT) return !ignore_error(result) && wants_reading();
  if (!ignore_error(result)) {
    // The context was shut down, or the middleware failed: the pause avoids a busy loop.
    pause(std::chrono::milliseconds(200), std::chrono::milliseconds(200));
    return false;
  }
  return wait_set_.guard_conditions[place] != nullptr || wants_reading();
}

Duration GraphWatcher::pause(Duration duration, Duration if_asked) {
  const auto begin = Clock::now();
  Duration idle{};
  const auto end = [&] { return begin + (refresh_ ? std::min(duration, if_asked) : duration); };
  while (Clock::now() < end()) {
    const auto until = std::min<Clock::time_point>(end(), serve());
    const auto idle_from = Clock::now();
    std::unique_lock lock(mutex_);
    poked_.wait_until(lock, until, [&] { return stop_ || std::exchange(news_, false); });
    idle += Clock::now() - idle_from;
    if (stop_) break;
  }
  return idle;
}

void GraphWatcher::read(bool changed) {
  read_again_ = false;
  const bool asked = refresh_.exchange(false);
  std::set<std::string> watched;
  {
    const std::lock_guard lock(mutex_);
    watched = watched_;
  }
  answered_.clear();
  auto graph = reading_.read(watched, changed, [this](Duration rest) { return leave(rest); });
  incomplete_ = reading_.unknown_names() || !graph;
  retries_ = incomplete_ ? retries_ + 1 : 0;
  if (!graph) {
    if (asked) refresh_ = true;
    return;
  }
  // Reports of single topics may be newer than this reading, so these topics are read again.
  for (const auto& topic : answered_) reading_.read_topic(topic, *graph);
  if (asked || *graph != last_) tell(std::move(*graph));
}

void GraphWatcher::read_topic(const std::string& topic) {
  if (!last_) return;  // one topic alone would count as the whole graph
  GraphChanged graph = *last_;
  if (!reading_.read_topic(topic, graph) || graph == *last_) return;
  answered_.insert(topic);
  tell(std::move(graph));
}

void GraphWatcher::tell(GraphChanged graph) {
  auto nodes = nodes_of(graph);
  last_ = graph;
  {
    const std::lock_guard lock(mutex_);
    nodes_ = std::move(nodes);
    newest_ = std::move(graph);
  }
  ReadyList::mark(slot(), kReadyMessage);
}

}  // namespace connect_bridge::ros
