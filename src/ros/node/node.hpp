// The ROS node of this process: context, names, arguments, parameter overrides, clock and log.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/ids.hpp"
#include "core/base/log_limit.hpp"
#include "core/base/time.hpp"
#include "core/ports/ports.hpp"
#include "ros/parameters/parameter.hpp"
#include "ros/rcl/ros_error.hpp"

struct rcl_node_s;
struct rcl_context_s;
struct rcl_clock_s;
struct rcl_publisher_s;

namespace connect_bridge::ros {

class OwnEndpoints;
class PublisherIds;

struct NodeFacts;

struct NodeOptions {
  std::string name;  // "connect_server", unless the arguments say otherwise
  // Arguments of main(): --ros-args with __node, __ns, --log-level, --params-file, -p.
  int argc = 0;
  const char* const* argv = nullptr;
  // True if the node will publish images, or other messages of megabytes (FastDdsProfile). Called
  // before the node is made, with the facts known by then: names, arguments, parameters. Empty:
  // false.
  std::function<bool(const NodeFacts& known)> publishes_images{};
};

// Facts about the node, known from the start.
struct NodeFacts {
  std::string name;        // "connect_server"
  std::string name_space;  // "/"
  std::string full_name;   // "/connect_server"
  // Parameters of files and -p for this node, merged.
  ParameterMap parameter_overrides;
  std::vector<std::string> parameter_files;  // from --params-file, in their order
  // Other nodes with parameters in the files: "connect_server", "/**/camera".
  std::vector<std::string> others_with_parameters;
  std::vector<std::string> arguments;  // from main(), without those for ROS and the program's name
};

// Outlives everything else of src/ros. Opens only the publishers that every ROS node has, /rosout
// and /parameter_events, so the parameters can be read and refused first.
class Node {
 public:
  explicit Node(const NodeOptions& options);
  ~Node();
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  [[nodiscard]] const NodeFacts& facts() const;
  // The present content of the files with -p, merged as at the start, and of a pipe what it had
  // then. Blocks as long as the disk does.
  struct Overrides {
    ParameterMap parameters;
    std::string problem;  // empty: the files were read
  };
  [[nodiscard]] Overrides read_overrides_again() const;

  // ROS time: the system's, or /clock's (Gateway::set_use_sim_time). Any thread.
  [[nodiscard]] Stamp ros_now() const;
  // Sets the level of log(); none: the level of the arguments. Any thread.
  void set_log_level(std::optional<LogLevel> level) const;
  // Logs to the console, the log file and /rosout, if the level is enabled. Any thread.
  void log(LogLevel level, const std::string& text) const;
  // The loop's time; only `steady` is set.
  [[nodiscard]] static Now steady_now();
  // Logs a line that a peer or a caller can cause as often as it likes: at a limited rate, with a
  // count.
  void log(LogLimit& limit, LogLevel level, const std::string& text) const;

  // Handles, for src/ros only.
  [[nodiscard]] rcl_node_s* handle() const;
  [[nodiscard]] rcl_context_s* context() const;
  [[nodiscard]] rcl_clock_s* clock() const;
  [[nodiscard]] rcl_publisher_s* parameter_events() const;
  [[nodiscard]] OwnEndpoints& own() const;
  // publisher_ids() and add_own() belong to the loop's thread.
  [[nodiscard]] PublisherIds& publisher_ids() const;
  // Registers the publisher as our own. Returns its id, for own().remove(); nullopt: the middleware
  // does not report it.
  std::optional<Gid> add_own(const rcl_publisher_s& publisher) const;
  // Lets the graph show this publisher of ours like anybody's. Without effect if the middleware
  // does not report its id.
  void show(const rcl_publisher_s& publisher) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace connect_bridge::ros
