// Where the core meets the ROS graph: its actions become entities, and what happens in the graph
// becomes inputs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "core/base/time.hpp"
#include "core/ports/ports.hpp"
#include "ros/node/node.hpp"

namespace connect_bridge::ros {

struct GatewayOptions {
  std::uint32_t message_bytes_max = 64U << 20;  // larger samples are dropped and reported
  int takes_per_wake_max = 64;                  // per drain(), so that sockets get their turn
  // The same in bytes: no more than the first packet takes, so that the next hop works on it while
  // this side takes the rest, and while it is in the caches.
  std::size_t bytes_per_wake_max = 64U << 10;
  Duration graph_pause = std::chrono::milliseconds(20);  // at least between two readings
};

// Counters since the start.
struct GatewayCounters {
  std::uint64_t taken = 0;
  std::uint64_t published = 0;
  std::uint64_t publish_failures = 0;
  std::uint64_t invalid = 0;      // samples too short to be one
  std::uint64_t too_large = 0;    // beyond message_bytes_max
  std::uint64_t own_samples = 0;  // of our own mirrors, ignored
  std::uint64_t recreated = 0;    // subscriptions made anew after invalid samples without end
  std::uint64_t graph_readings = 0;
  std::uint64_t requests = 0;       // taken at service mirrors
  std::uint64_t responses = 0;      // taken at service clients
  std::uint64_t refused_calls = 0;  // requests and responses that could not be carried
  std::uint32_t subscriptions = 0;
  std::uint32_t mirrors = 0;
  std::uint32_t service_mirrors = 0;
  std::uint32_t service_clients = 0;
  std::uint32_t pending_calls = 0;  // requests and invocations that are kept for an answer
  std::uint32_t proxy_nodes = 0;
  Duration graph_reading{};  // how long the last one took
};

// Thread: all calls from the loop's thread. Use: when `wake` was called, drain(); as long as it
// returns true, drain() again after the sockets had their turn. Destroy it before the Node; no
// input and no wake comes after that.
class Gateway {
 public:
  // `wake` is called from any thread, at most once until the next drain(); it must be cheap and
  // must not throw. Starts the thread that reads the graph; the first GraphChanged comes by itself.
  Gateway(Node& node, const GatewayOptions& options, std::function<void()> wake);
  ~Gateway();
  Gateway(const Gateway&) = delete;
  Gateway& operator=(const Gateway&) = delete;

  // Hands what has happened to `sink`, in turns over the entities that have something. The sink
  // may call apply(). Returns whether more is ready.
  bool drain(const std::function<void(Input&&)>& sink);

  // Carries out an action that is for ROS (CreateSubscription .. RefreshGraph) and returns true;
  // others are left alone. What fails comes as an input (SubscriptionFailed, InvocationFailed ..).
  // Unknown ids are ignored.
  bool apply(const Action& action);

  void apply(const CreateSubscription& action);
  void apply(const DestroySubscription& action);
  void apply(const CreateMirror& action);
  void apply(const DestroyMirror& action);
  void apply(const Publish& action);
  void apply(const RefreshGraph& action);

  // Whether Node::ros_now() follows /clock.
  void set_use_sim_time(bool on);

  [[nodiscard]] GatewayCounters counters() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace connect_bridge::ros
