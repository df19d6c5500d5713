#include "core/offers/export_right.hpp"

#include "core/policy/interface.hpp"

namespace connect_bridge {
namespace {

using Answer = ExportRight::Answer;

Answer answer_of(bool accepted) {
  return accepted ? Answer::kYes : Answer::kNotAccepted;  // mutant: accepted
}

// /parameter_events is one channel for all nodes. A peer that takes the parameters of any node gets
// the offer; each origin is then judged by its node (docs/protocol.md section 9.12, rule 2).
ExportRight right_to_events(const SideView& side, const Link& link, const std::string& type) {
  auto decision =
      side.policy.decide_parameter_events(Direction::kExport, type, link.login.identity());
  if (!decision) return {};
  if (!link.accepts) return {Answer::kUnknown, *std::move(decision)};
  return {answer_of(link.accepts->takes_parameters()), *std::move(decision)};
}

}  // namespace

ExportRight export_right(const SideView& side, const Link& link, const Interface& what) {
  auto decision = side.policy.decide(Direction::kExport, what,
                                     link.login.identity());  // mutant: export_right
  if (!decision) return {};
  if (!link.accepts) return {Answer::kUnknown, *std::move(decision)};
  return {answer_of(link.accepts->takes(what)), *std::move(decision)};
}

// Rules use the names of the wire, so that one rule serves robots under any prefix.
ExportRight export_right(const SideView& side, const Link& link, const LocalInterface& what) {
  const auto& [name, type] = what.key;
  const auto wire_name = link.names.to_wire(name);
  if (!wire_name) return {};
  if (is_parameter_events(what.kind, *wire_name)) return right_to_events(side, link, type);
  const auto action_type = side.actions.type_of(what.kind, name, type);
  if (!action_type) return {Answer::kNotWhole, {}};
  return export_right(side, link, Interface{what.kind, *wire_name, type, *action_type});
}

bool are_parameter_events(const Link& link, const LocalInterface& what) {
  const auto wire_name = link.names.to_wire(what.key.first);
  return wire_name && is_parameter_events(what.kind, *wire_name);
}

bool may_have_events(const SideView& side, const Link& link, std::string_view node) {
  const auto wire_node = link.names.to_wire(node);
  if (!wire_node) return false;
  const Interface what{
      InterfaceKind::kTopic, kParameterEvents, kParameterEventType, {}, *wire_node};
  return export_right(side, link, what).answer == Answer::kYes;
}

}  // namespace connect_bridge
