// The kinds of interfaces that channels carry, and the rule key that opens each: an ordinary topic
// or service, a part of an action, or the parameters of a node. Pure functions of names and types.
// docs/protocol.md section "Services and actions".
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/wire/control.hpp"

namespace connect_bridge {

// One channel as an offer or the graph describes it.
struct Interface {
  InterfaceKind kind = InterfaceKind::kTopic;  // kTopic or kService
  std::string_view name;                       // on the wire
  std::string_view type;
  // For a part of an action: the action's type, from the offer or from the graph
  // (Actions::type_of()). May be empty where the part's own type contains it.
  std::string_view action_type = {};
  // For an origin of /parameter_events: the name of its node, on the wire. Without it nothing is
  // opened: the topic has origins of many nodes, and each is decided separately.
  std::string_view node = {};
};

// ---- actions

// The services (first) and topics that an action consists of.
enum class ActionPart : std::uint8_t { kSendGoal, kCancelGoal, kGetResult, kFeedback, kStatus };
inline constexpr std::array<ActionPart, 5> kActionParts = {
    ActionPart::kSendGoal, ActionPart::kCancelGoal, ActionPart::kGetResult, ActionPart::kFeedback,
    ActionPart::kStatus};

struct PartOfAction {
  std::string_view action;  // "/navigate_to_pose", a piece of the part's name
  ActionPart part = ActionPart::kSendGoal;
  // "nav2_msgs/action/NavigateToPose", a piece of the part's type; empty for kCancelGoal and
  // kStatus, whose types are those of every action.
  std::string_view action_type = {};
};

// nullopt: no part of an action. Kind and type must be those of the part: a topic named
// "/a/_action/send_goal" is not a part.
[[nodiscard]] std::optional<PartOfAction> part_of_action(InterfaceKind kind, std::string_view name,
                                                         std::string_view type);

[[nodiscard]] InterfaceKind kind_of(ActionPart part);
// "/fib", kSendGoal -> "/fib/_action/send_goal"
[[nodiscard]] std::string name_of_part(std::string_view action, ActionPart part);
// "p/action/Fibonacci", kSendGoal -> "p/action/Fibonacci_SendGoal"
[[nodiscard]] std::string type_of_part(std::string_view action_type, ActionPart part);

// Whether the name has a token "_action": such a name is a part of an action or nothing at all.
[[nodiscard]] bool has_action_token(std::string_view name);

// The name to show to a person: for a part of an action, the action's name.
[[nodiscard]] std::string shown(InterfaceKind kind, const std::string& name, std::string_view type);

// ---- our own service

// The service of a node by which it takes and leaves wheels (docs/driving.md).
inline constexpr std::string_view kDriveSwitch = "/drive";
[[nodiscard]] constexpr bool is_drive_switch(std::string_view service, std::string_view node) {
  return service.size() == node.size() + kDriveSwitch.size() && service.starts_with(node) &&
         service.ends_with(kDriveSwitch);
}

// ---- parameters

struct ParameterService {
  std::string_view token;  // the last one of its name
  std::string_view type;
};
inline constexpr std::array<ParameterService, 6> kParameterServices{{
    {"get_parameters", "rcl_interfaces/srv/GetParameters"},
    {"set_parameters", "rcl_interfaces/srv/SetParameters"},
    {"list_parameters", "rcl_interfaces/srv/ListParameters"},
    {"describe_parameters", "rcl_interfaces/srv/DescribeParameters"},
    {"get_parameter_types", "rcl_interfaces/srv/GetParameterTypes"},
    {"set_parameters_atomically", "rcl_interfaces/srv/SetParametersAtomically"},
}};
// "/talker/get_parameters" of its right type -> "/talker", for each of the six parameter services.
[[nodiscard]] std::optional<std::string_view> node_of_parameter_service(std::string_view name,
                                                                        std::string_view type);
// Whether the last token is that of a parameter service, of whatever type.
[[nodiscard]] bool is_parameter_service_name(std::string_view name);
inline constexpr char kDiagnosticsTopic[] = "/diagnostics";  // each bridge publishes it, too
inline constexpr std::string_view kParameterEvents = "/parameter_events";  // on the wire
inline constexpr std::string_view kParameterEventType = "rcl_interfaces/msg/ParameterEvent";
[[nodiscard]] bool is_parameter_events(InterfaceKind kind, std::string_view name);

// ---- bridges

// Topics by which the bridges of one graph inform each other. No rule opens them to a peer.
inline constexpr std::string_view kBridgeNames = "/_connect_bridge/";
[[nodiscard]] inline bool is_of_bridges(std::string_view name) {
  return name.starts_with(kBridgeNames);
}

// ---- types

// "package/msg/Type", "package/action/Type_FeedbackMessage", and the event topics of service
// introspection ("package/srv/Type_Event").
[[nodiscard]] bool is_topic_type(std::string_view type);
// "package/srv/Type", "package/action/Type_SendGoal", "package/action/Type_GetResult".
[[nodiscard]] bool is_service_type(std::string_view type);
// "package/action/Type"
[[nodiscard]] bool is_action_type(std::string_view type);

// ---- what opens it

enum class OpenedBy : std::uint8_t { kNothing, kTopics, kServices, kActions, kParameters };
inline constexpr auto kKindsOfRules = std::to_array(
    {OpenedBy::kTopics, OpenedBy::kServices, OpenedBy::kActions, OpenedBy::kParameters});

struct Opening {
  OpenedBy by = OpenedBy::kNothing;
  std::string_view name = {};  // for the patterns: of the topic, service, action or node
  std::string_view type = {};  // for `types`: of the topic, service or action; parameters: empty
};

// The names by which a rule opens this interface. kNothing for everything that is invalid: names
// that are not canonical, types that do not fit, parts without a fitting action type, bridges' own.
[[nodiscard]] Opening opening_of(const Interface& what);

// Whether a deny pattern covers it, where `covers(name)` decides this for one name. One of a part
// denies the whole action, because the rest would not be usable; and single parameter services of a
// node can be denied, for example by "/**/set_parameters".
template <class Covers>
[[nodiscard]] bool is_denied(const Interface& what, const Opening& opening, const Covers& covers) {
  if (covers(opening.name)) return true;
  if (opening.by == OpenedBy::kParameters) return covers(what.name);
  return opening.by == OpenedBy::kActions &&
         std::any_of(kActionParts.begin(), kActionParts.end(),
                     [&](ActionPart part) { return covers(name_of_part(opening.name, part)); });
}

}  // namespace connect_bridge
