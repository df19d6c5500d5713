#include "ros/parameters/parameter_server.hpp"

#include <rcl/publisher.h>
#include <rcl_interfaces/msg/parameter_event.h>
#include <rcl_interfaces/msg/set_parameters_result.h>
#include <rcl_interfaces/srv/describe_parameters.h>
#include <rcl_interfaces/srv/get_parameter_types.h>
#include <rcl_interfaces/srv/get_parameters.h>
#include <rcl_interfaces/srv/list_parameters.h>
#include <rcl_interfaces/srv/set_parameters.h>
#include <rcl_interfaces/srv/set_parameters_atomically.h>
#include <rmw/qos_profiles.h>
#include <rosidl_runtime_c/primitives_sequence_functions.h>

#include <algorithm>

#include "ros/entities/ready_list.hpp"
#include "ros/parameters/own_service.hpp"
#include "ros/parameters/parameter_messages.hpp"
#include "ros/parameters/parameter_table.hpp"
#include "ros/rcl/rcl_result.hpp"

namespace connect_bridge::ros {
namespace {

constexpr char kUseSimTime[] = "use_sim_time";
constexpr int kStepsPerDrain = 16;

#define CONNECT_SERVICE_TYPE(name)                                                              \
  struct name {                                                                                 \
    using Request = rcl_interfaces__srv__##name##_Request;                                      \
    using Response = rcl_interfaces__srv__##name##_Response;                                    \
    static constexpr auto* create_request = &rcl_interfaces__srv__##name##_Request__create;     \
    static constexpr auto* destroy_request = &rcl_interfaces__srv__##name##_Request__destroy;   \
    static constexpr auto* create_response = &rcl_interfaces__srv__##name##_Response__create;   \
    static constexpr auto* destroy_response = &rcl_interfaces__srv__##name##_Response__destroy; \
    static const rosidl_service_type_support_t* type_support() {                                \
      return ROSIDL_GET_SRV_TYPE_SUPPORT(rcl_interfaces, srv, name);                            \
    }                                                                                           \
  }
CONNECT_SERVICE_TYPE(DescribeParameters);
CONNECT_SERVICE_TYPE(GetParameterTypes);
CONNECT_SERVICE_TYPE(GetParameters);
CONNECT_SERVICE_TYPE(ListParameters);
CONNECT_SERVICE_TYPE(SetParameters);
CONNECT_SERVICE_TYPE(SetParametersAtomically);
#undef CONNECT_SERVICE_TYPE

std::vector<Parameter> parameters_of(const rcl_interfaces__msg__Parameter__Sequence& messages) {
  std::vector<Parameter> parameters;
  parameters.reserve(messages.size);
  for (std::size_t i = 0; i < messages.size; ++i) {
    parameters.push_back(parameter_of(messages.data[i]));
  }
  return parameters;
}

bool fill(rcl_interfaces__msg__SetParametersResult& to, const SetResult& result) {
  to.successful = result.successful;
  return assign(to.reason, result.reason);
}

ParameterDescriptor sim_time_entry(bool on) {
  ParameterDescriptor entry;
  entry.name = kUseSimTime;
  entry.type = ParameterType::kBool;
  entry.value = on;
  entry.description = "Whether this node's time follows /clock";
  return entry;
}

bool is_on(const ParameterDescriptor* entry) {
  return entry && entry->value && *entry->value == ParameterValue{true};
}

}  // namespace

struct ParameterServer::State {
  State(Node& the_node, ParameterServerOptions the_options);
  std::vector<ParameterDescriptor> entries();

  template <class Type>
  void serve(const char* name,
             bool (State::*handler)(const typename Type::Request&, typename Type::Response&)) {
    services.push_back(std::make_unique<TypedService<Type>>(
        ready, node, node.facts().full_name + "/" + name, rmw_qos_profile_parameters,
        [this, handler](const auto& request, auto& response) {
          return (this->*handler)(request, response);
        }));
  }

  bool describe(const DescribeParameters::Request&, DescribeParameters::Response&);
  bool get(const GetParameters::Request&, GetParameters::Response&);
  bool get_types(const GetParameterTypes::Request&, GetParameterTypes::Response&);
  bool list(const ListParameters::Request&, ListParameters::Response&);
  bool set(const SetParameters::Request&, SetParameters::Response&);
  bool set_all(const SetParametersAtomically::Request&, SetParametersAtomically::Response&);

  SetResult apply(std::vector<Parameter> parameters);
  SetResult ask(const std::vector<Parameter>& parameters);
  void publish(const ParameterDifferences& differences);
  void follow_sim_time();

  Node& node;
  ParameterServerOptions options;
  ReadyList ready;
  ParameterTable table;
  bool sim_time = false;
  std::vector<std::unique_ptr<OwnService>> services;
};

ParameterServer::State::State(Node& the_node, ParameterServerOptions the_options)
    : node(the_node), options(std::move(the_options)), ready(options.wake), table(entries()) {
  serve<DescribeParameters>("describe_parameters", &State::describe);
  serve<GetParameterTypes>("get_parameter_types", &State::get_types);
  serve<GetParameters>("get_parameters", &State::get);
  serve<ListParameters>("list_parameters", &State::list);
  serve<SetParameters>("set_parameters", &State::set);
  serve<SetParametersAtomically>("set_parameters_atomically", &State::set_all);
  ParameterDifferences declared;
  for (const auto& entry : table.entries()) declared.added.push_back({entry.name, entry.value});
  publish(declared);
  follow_sim_time();
}

std::vector<ParameterDescriptor> ParameterServer::State::entries() {
  const auto& given = node.facts().parameter_overrides;
  const auto wanted = given.find(kUseSimTime);
  options.entries.push_back(
      sim_time_entry(wanted != given.end() && wanted->second == ParameterValue{true}));
  return std::move(options.entries);
}

void ParameterServer::State::publish(const ParameterDifferences& differences) {
  if (differences.empty()) return;
  const std::unique_ptr<rcl_interfaces__msg__ParameterEvent,
                        decltype(&rcl_interfaces__msg__ParameterEvent__destroy)>
      event(rcl_interfaces__msg__ParameterEvent__create(),
            &rcl_interfaces__msg__ParameterEvent__destroy);
  if (!event) return;
  const Stamp now = node.ros_now();
  event->stamp.sec = static_cast<std::int32_t>(now / 1000000000);
  event->stamp.nanosec = static_cast<std::uint32_t>(now % 1000000000);
  const bool filled = assign(event->node, node.facts().full_name) &&
                      ros::fill(event->new_parameters, differences.added) &&
                      ros::fill(event->changed_parameters, differences.changed) &&
                      ros::fill(event->deleted_parameters, differences.removed);
  if (filled) ignore_error(rcl_publish(node.parameter_events(), event.get(), nullptr));
}

bool ParameterServer::State::describe(const DescribeParameters::Request& request,
                                      DescribeParameters::Response& response) {
  const auto names = texts_of(request.names);
  auto& list = response.descriptors;
  if (!rcl_interfaces__msg__ParameterDescriptor__Sequence__init(&list, names.size())) return false;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const ParameterDescriptor* entry = table.find(names[i]);
    ParameterDescriptor unknown;
    unknown.name = names[i];
    unknown.type = ParameterType::kNotSet;
    if (!ros::fill(list.data[i], entry ? *entry : unknown)) return false;
  }
  return true;
}

bool ParameterServer::State::get(const GetParameters::Request& request,
                                 GetParameters::Response& response) {
  const auto names = texts_of(request.names);
  auto& list = response.values;
  if (!rcl_interfaces__msg__ParameterValue__Sequence__init(&list, names.size())) return false;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const ParameterDescriptor* entry = table.find(names[i]);
    if (entry && !ros::fill(list.data[i], entry->value)) return false;
  }
  return true;
}

bool ParameterServer::State::get_types(const GetParameterTypes::Request& request,
                                       GetParameterTypes::Response& response) {
  const auto names = texts_of(request.names);
  if (!rosidl_runtime_c__uint8__Sequence__init(&response.types, names.size())) return false;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const ParameterDescriptor* entry = table.find(names[i]);
    const bool is_set = entry && entry->value;
    response.types.data[i] =
        static_cast<std::uint8_t>(is_set ? type_of(*entry->value) : ParameterType::kNotSet);
  }
  return true;
}

bool ParameterServer::State::list(const ListParameters::Request& request,
                                  ListParameters::Response& response) {
  const auto prefixes = texts_of(request.prefixes);
  std::vector<std::string> names, parents;
  for (const ParameterDescriptor& entry : table.entries()) {
    // As in rclcpp, a parameter without a value is listed.
    if (!is_listed(entry.name, prefixes, request.depth)) continue;
    names.push_back(entry.name);
    const auto dot = entry.name.rfind('.');
    if (dot == std::string::npos) continue;
    const std::string parent = entry.name.substr(0, dot);
    if (std::find(parents.begin(), parents.end(), parent) == parents.end()) {
      parents.push_back(parent);
    }
  }
  return assign(response.result.names, names) && assign(response.result.prefixes, parents);
}

bool ParameterServer::State::set(const SetParameters::Request& request,
                                 SetParameters::Response& response) {
  const auto parameters = parameters_of(request.parameters);
  auto& list = response.results;
  if (!rcl_interfaces__msg__SetParametersResult__Sequence__init(&list, parameters.size())) {
    return false;
  }
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    if (!fill(list.data[i], apply({parameters[i]}))) return false;
  }
  return true;
}

bool ParameterServer::State::set_all(const SetParametersAtomically::Request& request,
                                     SetParametersAtomically::Response& response) {
  return fill(response.result, apply(parameters_of(request.parameters)));
}

SetResult ParameterServer::State::apply(std::vector<Parameter> parameters) {
  ParameterDifferences differences;
  const auto asking = [this](const std::vector<Parameter>& checked) { return ask(checked); };
  const SetResult result =
      table.apply(std::move(parameters), asking, options.describe, differences);
  publish(differences);
  follow_sim_time();
  return result;
}

// use_sim_time is handled here; the owner decides about everything else.
SetResult ParameterServer::State::ask(const std::vector<Parameter>& parameters) {
  std::vector<Parameter> others;
  std::copy_if(parameters.begin(), parameters.end(), std::back_inserter(others),
               [](const Parameter& parameter) { return parameter.name != kUseSimTime; });
  if (others.empty() || !options.set) return {};
  return options.set(others);
}

void ParameterServer::State::follow_sim_time() {
  const bool on = is_on(table.find(kUseSimTime));
  if (on == sim_time) return;
  sim_time = on;
  if (options.use_sim_time) options.use_sim_time(on);
}

ParameterServer::ParameterServer(Node& node, ParameterServerOptions options)
    : state_(std::make_unique<State>(node, std::move(options))) {}

ParameterServer::~ParameterServer() = default;

SetResult ParameterServer::set(std::vector<Parameter> parameters) {
  return state_->apply(std::move(parameters));
}

bool ParameterServer::drain() {
  State& state = *state_;
  state.ready.collect();
  Batch batch;
  while (!state.ready.idle() && batch.steps < kStepsPerDrain) state.ready.step(batch);
  return !state.ready.idle();
}

}  // namespace connect_bridge::ros
