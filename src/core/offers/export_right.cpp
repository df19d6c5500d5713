#include "core/offers/export_right.hpp"

#include "core/policy/interface.hpp"

namespace connect_bridge {
namespace {

using Answer = ExportRight::Answer;

Answer answer_of(bool accepted) {
  return accepted ? Answer::kYes : Answer::kNotAccepted;  // mutant: accepted
}

// The topic is one channel for all nodes, and is offered to whoever takes the parameters of some;
// each origin is judged by its node (docs/protocol.md section 9.12, rule 2).
ExportRight right_to_events(const SideView& side, const Link& link, const std::string& type) {
  auto decision =
      side.policy.decide_parameter_events(Direction::kExport, type, link.login.identity());
  if (!decision) return {};
  if (!link.accepts) return {Answer::kUnknown, *std::move(decision)};
  return {answer_of(link.accepts->takes_parameters()), *std::move(decision)};
}

}  // namespace

std::shared_ptr<const LocalInterface> local_interface(const SideView& side, InterfaceKind kind,
                                                      std::pair<std::string, std::string> key) {
  auto wire_name = side.graph_options.names.to_wire(key.first);
  const bool events = wire_name && is_parameter_events(kind, *wire_name);
  return std::make_shared<LocalInterface>(
      LocalInterface{kind, std::move(key), std::move(wire_name), events});
}

ExportRight export_right(const SideView& side, const Link& link, const Interface& what) {
  auto decision = side.policy.decide(Direction::kExport, what,
                                     link.login.identity());  // mutant: export_right
  if (!decision) return {};
  if (!link.accepts) return {Answer::kUnknown, *std::move(decision)};
  return {answer_of(link.accepts->takes(what)), *std::move(decision)};
}

// Rules speak of names as the wire has them, so that one rule serves robots under any prefix.
ExportRight export_right(const SideView& side, const Link& link, const LocalInterface& what) {
  if (!what.wire_name) return {};
  const auto& [name, type] = what.key;
  if (what.parameter_events) return right_to_events(side, link, type);
  const auto action_type = side.actions.type_of(what.kind, name, type);
  if (!action_type) return {Answer::kNotWhole, {}};
  return export_right(side, link, Interface{what.kind, *what.wire_name, type, *action_type});
}

bool may_have_events(const SideView& side, const Link& link, std::string_view node) {
  const auto wire_node = side.graph_options.names.to_wire(std::string(node));
  if (!wire_node) return false;
  const Interface what{
      InterfaceKind::kTopic, kParameterEvents, kParameterEventType, {}, *wire_node};
  return export_right(side, link, what).answer == Answer::kYes;
}

}  // namespace connect_bridge
