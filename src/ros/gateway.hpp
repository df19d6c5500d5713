// Connects the core to the ROS graph: actions of the core become entities, and events of the graph
// become inputs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "core/base/time.hpp"
#include "ros/entities/entities.hpp"
#include "ros/graph/graph_watcher.hpp"
#include "ros/services/services.hpp"
#include "ros/topics/diagnostics_topic.hpp"
#include "ros/topics/sample_check.hpp"
#include "ros/topics/subscription.hpp"
#include "ros/topics/time_source.hpp"
#include "ros/topics/topic_mirror.hpp"

namespace connect_bridge::ros {

struct GatewayOptions {
  std::uint32_t message_bytes_max = 64U << 20;  // larger samples are dropped and reported
  // Types whose packages are not installed are forwarded, too, if the middleware can.
  bool types_not_installed = true;
  int steps_per_wake_max = 64;  // per drain(), so that sockets get their turn
  // Bytes per drain(): no more than the first packet takes. So the next hop works on that packet
  // while this side takes the rest, and its bytes are still in the caches.
  std::size_t bytes_per_wake_max = 64U << 10;
  Duration graph_pause = std::chrono::milliseconds(20);  // shortest pause between two readings
};

// All calls come from the loop's thread. After a `wake`, call drain() once, when the sockets have
// had their turn; it wakes again while more is ready. Destroy the gateway before the Node; no input
// and no wake follows.
class Gateway {
 public:
  // Starts the thread that reads the graph; the first GraphChanged needs no request. `wake` is
  // called from any thread, at most once until the next drain(); it must be cheap and must not
  // throw.
  Gateway(Node& node, const GatewayOptions& options, std::function<void()> wake);

  // Passes events to `sink` as inputs, in turns over the ready entities. The sink may call apply().
  // True if more is ready.
  bool drain(const std::function<void(Input&&)>& sink);

  // Carries out an action of the core. A failure becomes an input (SubscriptionFailed,
  // InvocationFailed, ...). Unknown ids are ignored.
  void apply(const CreateSubscription& action) { subscriptions_.create(action); }
  void apply(const DestroySubscription& action) { subscriptions_.destroy(action.id); }
  void apply(const CreateMirror& action) { mirrors_.create(action); }
  void apply(const DestroyMirror& action) { mirrors_.destroy(action.id); }
  void apply(const Publish& action);
  void apply(const CreateServiceMirror& action) { services_.mirrors.create(action); }
  void apply(const DestroyServiceMirror& action) { services_.mirrors.destroy(action.id); }
  void apply(const SendResponse& action);
  void apply(const DropRequest& action);
  void apply(const CreateServiceClient& action) { services_.create_client(action); }
  void apply(const DestroyServiceClient& action) { services_.destroy_client(action.id); }
  void apply(const SendRequest& action);
  void apply(const DropInvocation& action);
  void apply(const FollowClock& action) { time_.follow(action.on); }
  void apply(const RefreshGraph& action) { graph_.refresh(action.topic); }

  // Lets Node::ros_now() follow /clock, even if the core does not ask for it.
  void set_use_sim_time(bool on) { time_.set(on); }

  // Opens the publisher on /diagnostics for this process. Call it once; returns the problem, empty:
  // none.
  [[nodiscard]] std::string open_diagnostics();
  // True if /diagnostics has a subscriber.
  [[nodiscard]] bool diagnostics_wanted() const { return diagnostics_.wanted(); }
  void publish_diagnostics(ByteView sample) { diagnostics_.publish(sample); }

  [[nodiscard]] GatewayCounters counters() const;

 private:
  // Publishes some of the checked samples. True if there may be more.
  bool publish_checked();
  void on_checked(const SampleCheck::Sample& sample);
  // Adds the lack of its type, if any, to each topic and service.
  void add_lacks(GraphChanged& graph);

  const GatewayOptions options_;
  Shared shared_;
  Entities<Subscription> subscriptions_{shared_};
  Entities<TopicMirror> mirrors_{shared_};
  Services services_{shared_, graph_};
  TimeSource time_{shared_};
  DiagnosticsTopic diagnostics_{shared_};
  GraphWatcher graph_;  // last, with check_: their threads end first
  SampleCheck check_{[this] { shared_.ready.wake(); }};
};

}  // namespace connect_bridge::ros
