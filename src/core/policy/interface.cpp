#include "core/policy/interface.hpp"

#include "core/policy/pattern.hpp"

namespace connect_bridge {
namespace {

constexpr std::string_view kActionToken = "/_action/";
constexpr std::string_view kCancelGoal = "action_msgs/srv/CancelGoal";
constexpr std::string_view kGoalStatus = "action_msgs/msg/GoalStatusArray";

struct PartRow {
  ActionPart part;
  InterfaceKind kind;
  std::string_view token;  // after "/_action/"
  std::string_view
      suffix;  // of its type after the action's; empty: `type` is the same for every action
  std::string_view type;
};
constexpr std::array<PartRow, 5> kPartRows{{
    {ActionPart::kSendGoal, InterfaceKind::kService, "send_goal", "_SendGoal", ""},
    {ActionPart::kCancelGoal, InterfaceKind::kService, "cancel_goal", "", kCancelGoal},
    {ActionPart::kGetResult, InterfaceKind::kService, "get_result", "_GetResult", ""},
    {ActionPart::kFeedback, InterfaceKind::kTopic, "feedback", "_FeedbackMessage", ""},
    {ActionPart::kStatus, InterfaceKind::kTopic, "status", "", kGoalStatus},
}};

const PartRow& row_of(ActionPart part) {
  return kPartRows[static_cast<std::size_t>(part)];
}

const ParameterService* parameter_service(std::string_view name) {
  const auto token = name.substr(name.rfind('/') + 1);
  const auto* found =
      std::find_if(kParameterServices.begin(), kParameterServices.end(),
                   [&](const ParameterService& service) { return service.token == token; });
  return found == kParameterServices.end() ? nullptr : found;
}

// "msg", "srv" or "action" of a valid type name, else empty.
std::string_view kind_word(std::string_view type) {
  if (!is_type_name(type)) return {};
  const auto first = type.find('/') + 1;
  return type.substr(first, type.find('/', first) - first);
}

// Whether something stands before the suffix: "p/action/_SendGoal" has none.
bool has_suffix(std::string_view type, std::string_view suffix) {
  return type.size() > suffix.size() && type.ends_with(suffix) &&
         type[type.size() - suffix.size() - 1] != '/';
}

Opening opening_of_part(const Interface& what) {
  const auto part = part_of_action(what.kind, what.name, what.type);
  if (!part) return {};
  const auto stated = what.action_type;
  const auto type = part->action_type.empty() ? stated : part->action_type;
  // For cancel and status the offer alone says which action they belong to; for the others it must
  // not contradict their own type.
  if (!is_action_type(type) || (!stated.empty() && stated != type)) return {};
  return {OpenedBy::kActions, part->action, type};
}

}  // namespace

InterfaceKind kind_of(ActionPart part) {
  return row_of(part).kind;
}

std::string name_of_part(std::string_view action, ActionPart part) {
  std::string name{action};
  name += kActionToken;
  name += row_of(part).token;
  return name;
}

std::string type_of_part(std::string_view action_type, ActionPart part) {
  const auto& row = row_of(part);
  if (!row.type.empty()) return std::string{row.type};
  std::string type{action_type};
  type += row.suffix;
  return type;
}

bool has_action_token(std::string_view name) {
  constexpr std::string_view kToken = "/_action";
  for (auto at = name.find(kToken); at != std::string_view::npos; at = name.find(kToken, at + 1)) {
    const auto end = at + kToken.size();
    if (end == name.size() || name[end] == '/') return true;
  }
  return false;
}

std::optional<PartOfAction> part_of_action(InterfaceKind kind, std::string_view name,
                                           std::string_view type) {
  // The last one: what is before it must be a name of an action, which has no such token.
  const auto at = name.rfind(kActionToken);
  if (at == std::string_view::npos || at == 0) return std::nullopt;
  const auto action = name.substr(0, at);
  // Otherwise a pattern that spells out "_action" would open an action below a part of an action.
  if (has_action_token(action)) return std::nullopt;
  const auto token = name.substr(at + kActionToken.size());
  for (const auto& row : kPartRows) {
    if (row.token != token || row.kind != kind) continue;
    if (!row.type.empty()) {
      if (type != row.type) return std::nullopt;
      return PartOfAction{action, row.part, {}};
    }
    if (kind_word(type) != "action" || !has_suffix(type, row.suffix)) return std::nullopt;
    return PartOfAction{action, row.part, type.substr(0, type.size() - row.suffix.size())};
  }
  return std::nullopt;
}

std::string shown(InterfaceKind kind, const std::string& name, std::string_view type) {
  const auto part = part_of_action(kind, name, type);
  return part ? "the action " + std::string(part->action) : name;
}

bool is_parameter_service_name(std::string_view name) {
  return parameter_service(name) != nullptr;
}

std::optional<std::string_view> node_of_parameter_service(std::string_view name,
                                                          std::string_view type) {
  const auto* service = parameter_service(name);
  if (service == nullptr || service->type != type) return std::nullopt;
  // The node's name with the '/' behind it; a service at the root has no node.
  const auto node = name.substr(0, name.size() - service->token.size());
  if (node.size() < 2) return std::nullopt;
  return node.substr(0, node.size() - 1);
}

bool is_parameter_events(InterfaceKind kind, std::string_view name) {
  return kind == InterfaceKind::kTopic && name == kParameterEvents;
}

bool is_topic_type(std::string_view type) {
  const auto word = kind_word(type);
  return word == "msg" || (word == "srv" && has_suffix(type, "_Event")) ||
         (word == "action" && has_suffix(type, "_FeedbackMessage"));
}

bool is_service_type(std::string_view type) {
  const auto word = kind_word(type);
  return word == "srv" ||
         (word == "action" && (has_suffix(type, "_SendGoal") || has_suffix(type, "_GetResult")));
}

bool is_action_type(std::string_view type) {
  return kind_word(type) == "action";
}

Opening opening_of(const Interface& what) {
  const bool topic = what.kind == InterfaceKind::kTopic;
  if (!topic && what.kind != InterfaceKind::kService) return {};
  if (!is_canonical_name(what.name) || is_of_bridges(what.name)) return {};
  if (!(topic ? is_topic_type(what.type) : is_service_type(what.type))) return {};
  // The narrow kinds come first, and what looks like one of them without being one is nothing: a
  // pattern for topics or services, even `/**`, opens no part of an action, no parameter service
  // and no /parameter_events (docs/protocol.md sections 9.11 and 9.12).
  if (has_action_token(what.name)) return opening_of_part(what);
  if (is_parameter_events(what.kind, what.name)) {
    if (what.type != kParameterEventType) return {};
    if (!is_canonical_name(what.node) || has_action_token(what.node)) return {};
    return {OpenedBy::kParameters, what.node, {}};
  }
  if (topic) return {OpenedBy::kTopics, what.name, what.type};
  if (!is_parameter_service_name(what.name)) return {OpenedBy::kServices, what.name, what.type};
  const auto node = node_of_parameter_service(what.name, what.type);
  if (!node) return {};
  return {OpenedBy::kParameters, *node, {}};
}

}  // namespace connect_bridge
