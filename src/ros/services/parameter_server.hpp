// The parameter services of the node, for `ros2 param` and rqt, and /parameter_events.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ros/entities/entity.hpp"
#include "ros/node/node.hpp"
#include "ros/parameters/parameter.hpp"

namespace connect_bridge::ros {

struct ParameterServerOptions {
  // Returns the present parameters.
  std::function<std::vector<ParameterDescriptor>()> entries;
  // Called when a client sets parameters, after their names, types and ranges were found valid.
  // Sets all of them or none; after success the entries show them.
  std::function<SetResult(const std::vector<Parameter>&)> set;
  // Returns the entry of a name that may be set although it is not among the entries; nullopt: it
  // is refused. Only such a name can be removed (`ros2 param delete`).
  std::function<std::optional<ParameterDescriptor>(const std::string& name)> describe;
  // Called with the value of use_sim_time: at the start if it is true, and whenever it changes.
  // This parameter always exists and is not among the entries.
  std::function<void(bool on)> use_sim_time;
  // Called from any thread, at most once until the next drain().
  std::function<void()> wake;
};

// All calls come from the loop's thread. The options' functions, except `wake`, are called inside
// the constructor, drain() and set().
class ParameterServer {
 public:
  // Throws RosError.
  ParameterServer(Node& node, ParameterServerOptions options);
  ParameterServer(const ParameterServer&) = delete;
  ParameterServer& operator=(const ParameterServer&) = delete;

  // Sets parameters as if a client had set them together: calls `set`, and publishes the change.
  SetResult set(std::vector<Parameter> parameters);
  // Answers a bounded number of waiting requests. True if more wait.
  bool drain();

 private:
  using Entries = std::map<std::string, ParameterDescriptor>;

  template <class Service, class Handler>
  void serve(const char* name, Handler handler);
  [[nodiscard]] Entries entries() const;
  // Whether this parameter may be set; converts its value to the type of its entry.
  [[nodiscard]] SetResult check(Parameter& parameter, const Entries& now) const;
  void set_sim_time(bool on);
  // Publishes the changes of these parameters.
  void publish(const std::vector<Parameter>& parameters, const Entries& before) const;

  Node& node_;
  const ParameterServerOptions options_;
  ReadyList ready_;
  bool sim_time_ = false;
  std::vector<std::unique_ptr<Entity>> services_;
};

}  // namespace connect_bridge::ros
