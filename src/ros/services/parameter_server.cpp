#include "ros/services/parameter_server.hpp"

#include <rcl/publisher.h>
#include <rcl/service.h>
#include <rmw/qos_profiles.h>

#include <algorithm>
#include <exception>
#include <rcl_interfaces/msg/parameter_event.hpp>
#include <rcl_interfaces/srv/describe_parameters.hpp>
#include <rcl_interfaces/srv/get_parameter_types.hpp>
#include <rcl_interfaces/srv/get_parameters.hpp>
#include <rcl_interfaces/srv/list_parameters.hpp>
#include <rcl_interfaces/srv/set_parameters.hpp>
#include <rcl_interfaces/srv/set_parameters_atomically.hpp>
#include <rosidl_typesupport_cpp/service_type_support.hpp>
#include <set>
#include <tuple>
#include <utility>

#include "ros/rcl/rcl_result.hpp"

namespace connect_bridge::ros {
namespace {

namespace msg = rcl_interfaces::msg;
namespace srv = rcl_interfaces::srv;

constexpr char kUseSimTime[] = "use_sim_time";
constexpr int kStepsPerDrain = 16;

// The fields of a value, in the order of ParameterValue.
auto fields_of(auto& message) {
  return std::tie(message.bool_value, message.integer_value, message.double_value,
                  message.string_value, message.byte_array_value, message.bool_array_value,
                  message.integer_array_value, message.double_array_value,
                  message.string_array_value);
}

// The message for a value; PARAMETER_NOT_SET without one.
msg::ParameterValue to_message(const std::optional<ParameterValue>& value) {
  msg::ParameterValue message;
  if (!value) return message;
  message.type = static_cast<std::uint8_t>(type_of(*value));
  std::visit([&]<class Held>(const Held& held) { std::get<Held&>(fields_of(message)) = held; },
             *value);
  return message;
}

Parameter parameter_of(const msg::Parameter& message) {
  Parameter parameter{message.name, std::nullopt};
  const auto fields = fields_of(message.value);
  const auto take = [&]<std::size_t kIndex>() {
    const bool is_it = message.value.type == kIndex + 1;
    if (is_it) parameter.value.emplace(std::in_place_index<kIndex>, std::get<kIndex>(fields));
  };
  [&]<std::size_t... kIndex>(std::index_sequence<kIndex...>) {
    (take.template operator()<kIndex>(), ...);
  }
  (std::make_index_sequence<std::variant_size_v<ParameterValue>>());
  return parameter;
}

std::vector<Parameter> parameters_of(const std::vector<msg::Parameter>& messages) {
  std::vector<Parameter> parameters;
  for (const auto& message : messages) parameters.push_back(parameter_of(message));
  return parameters;
}

msg::ParameterDescriptor to_message(const ParameterDescriptor& entry) {
  msg::ParameterDescriptor message;
  message.name = entry.name;
  message.type = static_cast<std::uint8_t>(entry.type);
  message.description = entry.description;
  message.additional_constraints = entry.constraints;
  message.read_only = entry.read_only;
  if (entry.range && entry.type == ParameterType::kInteger) {
    message.integer_range.resize(1);
    message.integer_range[0].from_value = static_cast<std::int64_t>(entry.range->min);
    message.integer_range[0].to_value = static_cast<std::int64_t>(entry.range->max);
  }
  if (entry.range && entry.type == ParameterType::kDouble) {
    message.floating_point_range.resize(1);
    message.floating_point_range[0].from_value = entry.range->min;
    message.floating_point_range[0].to_value = entry.range->max;
  }
  return message;
}

msg::SetParametersResult to_message(const SetResult& result) {
  msg::SetParametersResult message;
  message.successful = result.successful;
  message.reason = result.reason;
  return message;
}

// One service that this process answers itself.
template <class Service>
class OwnService final : public Entity {
 public:
  using Request = typename Service::Request;
  using Response = typename Service::Response;
  using Handler = std::function<void(const Request& request, Response& response)>;

  // Throws RosError.
  OwnService(ReadyList& ready, Node& node, const std::string& name, Handler handler)
      : Entity(ready, kReadyMessage), node_(node), handler_(std::move(handler)) {
    set_name(name);
    rcl_service_options_t options = rcl_service_get_default_options();
    options.qos = rmw_qos_profile_parameters;
    const auto* type = rosidl_typesupport_cpp::get_service_type_support_handle<Service>();
    const std::string what = "cannot serve " + name;
    require_ok(rcl_service_init(&service_, node.handle(), type, name.c_str(), &options), what);
    const rcl_ret_t result =
        rcl_service_set_on_new_request_callback(&service_, &ReadyList::on_counted, slot());
    if (result != RCL_RET_OK) {
      const auto text = error_text(what, result);
      ignore_error(rcl_service_fini(&service_, node.handle()));
      throw RosError(text);
    }
    ReadyList::mark(slot(), kReadyMessage);
  }
  // The callback stays set, as in ServiceMirror.
  ~OwnService() override { ignore_error(rcl_service_fini(&service_, node_.handle())); }

  // Answers one request.
  std::optional<Input> step(Batch&) override {
    Request request;
    rmw_service_info_t info{};
    const bool more = expects_more();  // a take that fails looks like an empty queue
    if (!take(request, info)) {
      if (!more) done(kReadyMessage);
      return std::nullopt;
    }
    Response response;
    handler_(request, response);
    const rcl_ret_t result = rcl_send_response(&service_, &info.request_id, &response);
    // The client may have left before the answer was sent.
    if (result != RCL_RET_OK)
      node_.log(LogLevel::kDebug, error_text("cannot answer a request of " + name(), result));
    return std::nullopt;
  }

 private:
  // False: there is no request.
  bool take(Request& request, rmw_service_info_t& info) {
    const std::string what = "cannot take a request of " + name();
    try {
      const rcl_ret_t result = rcl_take_request_with_info(&service_, &info, &request);
      if (result == RCL_RET_OK || result == RCL_RET_SERVICE_TAKE_FAILED)
        return ignore_error(result);
      node_.log(LogLevel::kWarn, error_text(what, result));
    } catch (const std::exception& error) {  // a sequence that claims to be larger than memory
      node_.log(LogLevel::kWarn, what + ": " + error.what());
    }
    return false;
  }

  Node& node_;
  const Handler handler_;
  rcl_service_t service_ = rcl_get_zero_initialized_service();
};

std::optional<ParameterValue> value_in(const std::map<std::string, ParameterDescriptor>& entries,
                                       const std::string& name) {
  const auto found = entries.find(name);
  return found == entries.end() ? std::nullopt : found->second.value;
}

}  // namespace

template <class Service, class Handler>
void ParameterServer::serve(const char* name, Handler handler) {
  services_.push_back(std::make_unique<OwnService<Service>>(
      ready_, node_, node_.facts().full_name + "/" + name, std::move(handler)));
}

ParameterServer::ParameterServer(Node& node, ParameterServerOptions options)
    : node_(node), options_(std::move(options)), ready_(options_.wake) {
  serve<srv::DescribeParameters>("describe_parameters", [this](const auto& asked, auto& answer) {
    const Entries now = entries();
    for (const auto& name : asked.names) {
      const auto found = now.find(name);
      ParameterDescriptor unknown;
      unknown.name = name;
      unknown.type = ParameterType::kNotSet;
      answer.descriptors.push_back(to_message(found == now.end() ? unknown : found->second));
    }
  });
  serve<srv::GetParameterTypes>("get_parameter_types", [this](const auto& asked, auto& answer) {
    const Entries now = entries();
    for (const auto& name : asked.names) {
      const auto value = value_in(now, name);
      answer.types.push_back(
          static_cast<std::uint8_t>(value ? type_of(*value) : ParameterType::kNotSet));
    }
  });
  serve<srv::GetParameters>("get_parameters", [this](const auto& asked, auto& answer) {
    const Entries now = entries();
    for (const auto& name : asked.names) answer.values.push_back(to_message(value_in(now, name)));
  });
  serve<srv::ListParameters>("list_parameters", [this](const auto& asked, auto& answer) {
    std::set<std::string> parents;
    for (const auto& [name, entry] : entries()) {
      // Parameters without a value are listed, as in rclcpp.
      if (!is_listed(name, asked.prefixes, asked.depth)) continue;
      answer.result.names.push_back(name);
      if (const auto dot = name.rfind('.'); dot != std::string::npos)
        parents.insert(name.substr(0, dot));
    }
    answer.result.prefixes.assign(parents.begin(), parents.end());
  });
  serve<srv::SetParameters>("set_parameters", [this](const auto& asked, auto& answer) {
    for (auto& parameter : parameters_of(asked.parameters))
      answer.results.push_back(to_message(set({std::move(parameter)})));
  });
  serve<srv::SetParametersAtomically>(
      "set_parameters_atomically", [this](const auto& asked, auto& answer) {
        answer.result = to_message(set(parameters_of(asked.parameters)));
      });
  const auto& given = node_.facts().parameter_overrides;
  const auto wanted = given.find(kUseSimTime);
  set_sim_time(wanted != given.end() && wanted->second == ParameterValue{true});
  std::vector<Parameter> declared;
  for (const auto& [name, entry] : entries()) declared.push_back({name, entry.value});
  publish(declared, {});
}

ParameterServer::Entries ParameterServer::entries() const {
  Entries entries;
  for (auto& entry : options_.entries()) entries.emplace(entry.name, entry);
  ParameterDescriptor sim_time;
  sim_time.name = kUseSimTime;
  sim_time.type = ParameterType::kBool;
  sim_time.value = sim_time_;
  sim_time.description = "Whether this node's time follows /clock";
  entries.insert_or_assign(kUseSimTime, std::move(sim_time));
  return entries;
}

SetResult ParameterServer::check(Parameter& parameter, const Entries& now) const {
  const std::string& name = parameter.name;
  const auto known = now.find(name);
  const auto later = options_.describe(name);
  if (known == now.end() && (!later || !parameter.value))
    return {false, "parameter '" + name + "' cannot be set because it was not declared"};
  const ParameterDescriptor& entry = known == now.end() ? *later : known->second;
  if (entry.read_only)
    return {false, "parameter '" + name + "' cannot be set because it is read-only"};
  if (parameter.value) return check_value(entry, *parameter.value);
  return later ? SetResult{} : SetResult{false, "parameter '" + name + "' cannot be removed"};
}

// Only use_sim_time is handled here; the owner decides about all other parameters.
SetResult ParameterServer::set(std::vector<Parameter> parameters) {
  const Entries before = entries();
  bool sim_time = sim_time_;
  std::vector<Parameter> others;
  for (Parameter& parameter : parameters) {
    if (SetResult result = check(parameter, before); !result.successful) return result;
    if (parameter.name == kUseSimTime) {
      sim_time = std::get<bool>(*parameter.value);
    } else {
      others.push_back(parameter);
    }
  }
  if (!others.empty())
    if (SetResult result = options_.set(others); !result.successful) return result;
  set_sim_time(sim_time);
  publish(parameters, before);
  return {};
}

void ParameterServer::set_sim_time(bool on) {
  if (on != std::exchange(sim_time_, on)) options_.use_sim_time(on);
}

void ParameterServer::publish(const std::vector<Parameter>& parameters,
                              const Entries& before) const {
  if (parameters.empty()) return;
  const Entries now = entries();
  msg::ParameterEvent event;
  for (const Parameter& parameter : parameters) {
    const bool was = before.contains(parameter.name);
    const bool is = now.contains(parameter.name);
    if (!was && !is) continue;
    msg::Parameter& entry = (!was ? event.new_parameters
                             : is ? event.changed_parameters
                                  : event.deleted_parameters)
                                .emplace_back();
    entry.name = parameter.name;
    entry.value = to_message(value_in(is ? now : before, parameter.name));
  }
  const Stamp time = node_.ros_now();
  event.stamp.sec = static_cast<std::int32_t>(time / kStampSecond);
  event.stamp.nanosec = static_cast<std::uint32_t>(time % kStampSecond);
  event.node = node_.facts().full_name;
  ignore_error(rcl_publish(node_.parameter_events(), &event, nullptr));
}

bool ParameterServer::drain() {
  ready_.collect();
  Batch batch;
  while (!ready_.idle() && batch.steps < kStepsPerDrain) ready_.step(batch);
  return !ready_.idle();
}

}  // namespace connect_bridge::ros
