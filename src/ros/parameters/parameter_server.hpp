// The parameter services of the node, for `ros2 param` and rqt, and /parameter_events.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ros/node/node.hpp"
#include "ros/parameters/parameter.hpp"

namespace connect_bridge::ros {

struct ParameterServerOptions {
  std::vector<ParameterDescriptor> entries;
  // Called when a client sets parameters, after names, types and ranges were found valid: all of
  // them or none. The entries change when it agrees.
  std::function<SetResult(const std::vector<Parameter>&)> set;
  // The entry, without a value, of a name that is not in the table but may be set; empty or
  // nullopt: refused. Such an entry can be removed again (`ros2 param delete`).
  std::function<std::optional<ParameterDescriptor>(const std::string& name)> describe;
  // Called with the value of use_sim_time, at the start if it is true and whenever it changes. The
  // parameter is always there and not among the entries.
  std::function<void(bool on)> use_sim_time;
  // Called from any thread, at most once until the next drain().
  std::function<void()> wake;
};

// Thread: all calls from the loop's thread. `set` is called inside drain() and set().
class ParameterServer {
 public:
  ParameterServer(Node& node, ParameterServerOptions options);
  ~ParameterServer();
  ParameterServer(const ParameterServer&) = delete;
  ParameterServer& operator=(const ParameterServer&) = delete;

  // As if a client had set them together: calls `set`, changes the entries, and publishes the
  // change.
  SetResult set(std::vector<Parameter> parameters);
  // Answers waiting requests, a bounded number of them. Returns whether more wait.
  bool drain();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace connect_bridge::ros
