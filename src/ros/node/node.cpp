#include "ros/node/node.hpp"

#include <fmt/format.h>
#include <rcl/arguments.h>
#include <rcl/context.h>
#include <rcl/init.h>
#include <rcl/init_options.h>
#include <rcl/logging.h>
#include <rcl/logging_rosout.h>
#include <rcl/node.h>
#include <rcl/node_options.h>
#include <rcl/publisher.h>
#include <rcl/remap.h>
#include <rcl/time.h>
#include <rcutils/logging.h>
#include <rmw/error_handling.h>
#include <rmw/qos_profiles.h>
#include <rmw/rmw.h>

#include <algorithm>
#include <chrono>
#include <mutex>
#include <optional>
#include <rcl_interfaces/msg/parameter_event.hpp>
#include <rosidl_typesupport_cpp/message_type_support.hpp>

#include "ros/node/own_endpoints.hpp"
#include "ros/node/process_log.hpp"
#include "ros/parameters/parameter_arguments.hpp"
#include "ros/parameters/ros_arguments.hpp"
#include "ros/rcl/cyclone_publishers.hpp"
#include "ros/rcl/distro.hpp"
#include "ros/rcl/fastdds_profile.hpp"
#include "ros/rcl/middleware.hpp"
#include "ros/rcl/publisher_ids.hpp"
#include "ros/rcl/rcl_result.hpp"

namespace connect_bridge::ros {
namespace {

int severity_of(LogLevel level) {
  constexpr int kSeverities[] = {RCUTILS_LOG_SEVERITY_DEBUG, RCUTILS_LOG_SEVERITY_INFO,
                                 RCUTILS_LOG_SEVERITY_WARN, RCUTILS_LOG_SEVERITY_ERROR};
  return kSeverities[static_cast<std::size_t>(level)];
}

std::vector<const char*> pointers_to(const std::vector<std::string>& words) {
  std::vector<const char*> pointers;
  for (const auto& word : words) pointers.push_back(word.c_str());
  return pointers;
}

// The words at these places.
std::vector<std::string> pick(const std::vector<std::string>& words, int count, rcl_ret_t result,
                              int* places) {
  std::vector<std::string> texts;
  auto allocator = rcl_get_default_allocator();
  for (int i = 0; result == RCL_RET_OK && i < count; ++i) {
    texts.push_back(words.at(static_cast<std::size_t>(places[i])));
  }
  ignore_error(result);
  if (places != nullptr) allocator.deallocate(places, allocator.state);
  return texts;
}

// The full name that a node of this name will have after remapping.
std::string future_name(const rcl_arguments_t& arguments, const std::string& name) {
  auto allocator = rcl_get_default_allocator();
  const auto text_or = [&](char* text, const std::string& otherwise) {
    if (text == nullptr) return otherwise;
    std::string copy(text);
    allocator.deallocate(text, allocator.state);
    return copy;
  };
  char* output = nullptr;
  ignore_error(rcl_remap_node_name(nullptr, &arguments, name.c_str(), allocator, &output));
  const std::string last = text_or(output, name);
  output = nullptr;
  ignore_error(rcl_remap_node_namespace(nullptr, &arguments, name.c_str(), allocator, &output));
  std::string space = text_or(output, "/");
  if (space.empty() || space.front() != '/') space.insert(space.begin(), '/');
  return space + (space.back() == '/' ? "" : "/") + last;
}

}  // namespace

struct Node::State {
  rcl_context_t context = rcl_get_zero_initialized_context();
  rcl_node_t node = rcl_get_zero_initialized_node();
  rcl_clock_t clock{};
  rcl_publisher_t parameter_events = rcl_get_zero_initialized_publisher();
  OwnEndpoints own{middleware().participant_bytes};
  std::optional<PublisherIds> publisher_ids;
  bool logging = false;
  int first_severity = RCUTILS_LOG_SEVERITY_UNSET;  // of our own logger, by the arguments
  std::vector<std::string> warnings;                // of the start, for the log
  // As they were: main() may scrub secrets in its own. The words are all but those of parameters.
  std::vector<std::string> words;
  ParameterArguments parameters;
  NodeFacts facts;

  void open(const NodeOptions& options);
  void open_context();
  void read_arguments();
  void read_parameters();
  std::size_t domain();
  void open_publisher_ids();
  void open_parameter_events();
  // The id of the publisher in the graph; nullopt: not known.
  std::optional<Gid> id_of(const rcl_publisher_t& publisher);
  ~State();
};

void Node::State::open_context() {
  const auto allocator = rcl_get_default_allocator();
  rcl_init_options_t init = rcl_get_zero_initialized_init_options();
  require_ok(rcl_init_options_init(&init, allocator), "cannot set up ROS");
  const auto argv = pointers_to(words);
  const rcl_ret_t result = rcl_init(static_cast<int>(argv.size()),
                                    argv.empty() ? nullptr : argv.data(), &init, &context);
  const std::string problem =
      result == RCL_RET_OK ? std::string{} : error_text("cannot start ROS", result);
  ignore_error(rcl_init_options_fini(&init));
  if (!problem.empty()) throw RosError(problem);
}

void Node::State::read_arguments() {
  const auto allocator = rcl_get_default_allocator();
  const rcl_arguments_t& given = context.global_arguments;
  int* places = nullptr;
  rcl_ret_t result = rcl_arguments_get_unparsed_ros(&given, allocator, &places);
  const auto unknown = pick(words, rcl_arguments_get_count_unparsed_ros(&given), result, places);
  if (!unknown.empty())
    throw RosError("unknown ROS argument \"" + std::string(without_value(unknown.front())) + "\"");
  places = nullptr;
  result = rcl_arguments_get_unparsed(&given, allocator, &places);
  auto& arguments = facts.arguments;
  arguments = pick(words, rcl_arguments_get_count_unparsed(&given), result, places);
  if (!arguments.empty()) arguments.erase(arguments.begin());
}

void Node::State::read_parameters() {
  auto read = parameters.read_for(facts.full_name);
  if (!read.problems.empty()) throw RosError(fmt::format("{}", fmt::join(read.problems, "; ")));
  facts.parameter_overrides = std::move(read.parameters);
  facts.others_with_parameters = std::move(read.others);
  facts.parameter_files = parameters.files();
}

void Node::State::open(const NodeOptions& options) {
  const bool is_loaded = rmw_get_implementation_identifier() != nullptr;  // false: rcl reports why
  ask_for_whole_graph(is_loaded);
  // rcl itself gets no parameters: it reads a pipe to its end, and loses their order.
  words = ParameterArguments::without(options.argc, options.argv);
  parameters = ParameterArguments(options.argc, options.argv);
  open_context();
  read_arguments();
  facts.full_name = future_name(context.global_arguments, options.name);
  read_parameters();
  const bool publishes_images = options.publishes_images && options.publishes_images(facts);
  const FastDdsProfile profile(is_loaded, publishes_images ? FastDdsProfile::kLargeSegment : 0);
  warnings = profile.problems();
  const std::string no_file = begin_log(context.global_arguments, words);
  logging = true;
  if (!no_file.empty())
    warnings.push_back(no_file +
                       "; so no log file is written, as with --disable-external-lib-logs");
  // rcl_node_init() opens /rosout if it may, until Iron; since Jazzy it does not.
  rcl_node_options_t node_options = rcl_node_get_default_options();
  node_options.enable_rosout = false;
  require_ok(rcl_node_init(&node, options.name.c_str(), "", &context, &node_options),
             "cannot create the node");
  ignore_error(rcl_node_options_fini(&node_options));
  {
    const std::lock_guard lock(log_mutex());
    if (rcl_logging_rosout_enabled())
      require_ok(rcl_logging_rosout_init_publisher_for_node(&node), "cannot publish on /rosout");
  }
  auto allocator = rcl_get_default_allocator();
  require_ok(rcl_clock_init(RCL_ROS_TIME, &clock, &allocator), "cannot create a clock");
  open_publisher_ids();
  open_parameter_events();
  first_severity = std::max(0, rcutils_logging_get_logger_level(rcl_node_get_logger_name(&node)));
  facts.name = rcl_node_get_name(&node);
  facts.name_space = rcl_node_get_namespace(&node);
  facts.full_name = rcl_node_get_fully_qualified_name(&node);
  own.settle_node(facts.full_name);
}

std::size_t Node::State::domain() {
  std::size_t id = 0;
  require_ok(rcl_context_get_domain_id(&context, &id), "cannot read the domain id");
  return id;
}

void Node::State::open_publisher_ids() {
  if (middleware().publisher_named == Middleware::PublisherNamed::kId) {
    publisher_ids.emplace();
    return;
  }
  auto publishers = std::make_shared<CyclonePublishers>(domain());
  publisher_ids.emplace([publishers] { return publishers->changes(); });
}

std::optional<Gid> Node::State::id_of(const rcl_publisher_t& publisher) {
  const rmw_publisher_t* handle = rcl_publisher_get_rmw_handle(&publisher);
  rmw_gid_t reported{};
  if (handle == nullptr || rmw_get_gid_for_publisher(handle, &reported) != RMW_RET_OK) {
    rmw_reset_error();
    return std::nullopt;
  }
  const Gid gid = distro::gid_of(reported.data);
  const Gid id = publisher_ids->id_of(gid);
  const bool unknown = middleware().publisher_named == Middleware::PublisherNamed::kHandle &&
                       (id == gid || id == Gid{});
  if (unknown) return std::nullopt;
  return id;
}

// The publisher is opened here, because its id is the first one that identifies our endpoints.
void Node::State::open_parameter_events() {
  rcl_publisher_options_t options = rcl_publisher_get_default_options();
  options.qos = rmw_qos_profile_parameter_events;
  const auto* type = rosidl_typesupport_cpp::get_message_type_support_handle<
      rcl_interfaces::msg::ParameterEvent>();
  require_ok(rcl_publisher_init(&parameter_events, &node, type, "/parameter_events", &options),
             "cannot publish on /parameter_events");
  // Without this id our own endpoints would be bridged like those of others.
  const auto id = id_of(parameter_events);
  if (id) own.add(*id);
  if (!id && middleware().participant_bytes > 0)
    throw RosError("the middleware does not report the id of this node's own publisher");
}

Node::State::~State() {
  publisher_ids.reset();
  if (parameter_events.impl != nullptr) ignore_error(rcl_publisher_fini(&parameter_events, &node));
  if (rcl_clock_valid(&clock)) ignore_error(rcl_clock_fini(&clock));
  if (rcl_node_is_valid_except_context(&node)) {
    const std::lock_guard lock(log_mutex());
    if (rcl_logging_rosout_enabled())
      ignore_error(rcl_logging_rosout_fini_publisher_for_node(&node));
    ignore_error(rcl_node_fini(&node));
  }
  ignore_error(RCL_RET_OK);  // the calls above leave an error text
  if (rcl_context_is_valid(&context)) ignore_error(rcl_shutdown(&context));
  if (logging) end_log();
  if (context.impl != nullptr) ignore_error(rcl_context_fini(&context));
}

Node::Node(const NodeOptions& options) : state_(std::make_unique<State>()) {
  state_->open(options);
  for (const auto& warning : state_->warnings) log(LogLevel::kWarn, warning);
}

Node::~Node() = default;

const NodeFacts& Node::facts() const {
  return state_->facts;
}

Node::Overrides Node::read_overrides_again() const {
  auto read = state_->parameters.read_for(facts().full_name);
  return {std::move(read.parameters), fmt::format("{}", fmt::join(read.problems, "; "))};
}

Stamp Node::ros_now() const {
  rcl_time_point_value_t now = 0;
  ignore_error(rcl_clock_get_now(&state_->clock, &now));
  return now;
}

void Node::set_log_level(std::optional<LogLevel> level) const {
  const std::lock_guard lock(log_mutex());
  ignore_error(
      rcutils_logging_set_logger_level(rcl_node_get_logger_name(&state_->node),
                                       level ? severity_of(*level) : state_->first_severity));
}

void Node::log(LogLevel level, const std::string& text) const {
  const int severity = severity_of(level);
  const char* logger = rcl_node_get_logger_name(&state_->node);
  // Reading the level may store it for the next time, so the lock is needed here, too.
  const std::lock_guard lock(log_mutex());
  if (!rcutils_logging_logger_is_enabled_for(logger, severity)) return;
  // The output to /rosout reads the location without a check for null.
  static constexpr rcutils_log_location_t kNowhere{"", "", 0};
  rcutils_log(&kNowhere, severity, logger, "%s", text.c_str());
}

Now Node::steady_now() {
  Now now;
  now.steady = TimePoint(std::chrono::steady_clock::now().time_since_epoch());
  return now;
}

void Node::log(LogLimit& limit, LogLevel level, const std::string& text) const {
  const auto count = limit.count(steady_now());
  if (count)
    log(level,
        *count == 1 ? text : text + " (" + std::to_string(*count) + " times since the last line)");
}

rcl_node_s* Node::handle() const {
  return &state_->node;
}
rcl_context_s* Node::context() const {
  return &state_->context;
}
rcl_clock_s* Node::clock() const {
  return &state_->clock;
}
rcl_publisher_s* Node::parameter_events() const {
  return &state_->parameter_events;
}
OwnEndpoints& Node::own() const {
  return state_->own;
}
PublisherIds& Node::publisher_ids() const {
  return *state_->publisher_ids;
}
std::optional<Gid> Node::add_own(const rcl_publisher_s& publisher) const {
  const auto id = state_->id_of(publisher);
  if (id) state_->own.add(*id);
  return id;
}
void Node::show(const rcl_publisher_s& publisher) const {
  if (const auto id = state_->id_of(publisher)) state_->own.show(*id);
}

}  // namespace connect_bridge::ros
