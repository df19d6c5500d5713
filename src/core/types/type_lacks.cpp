#include "core/types/type_lacks.hpp"

#include <utility>

#include "core/policy/interface.hpp"

namespace connect_bridge {
namespace {

std::string shown_name(InterfaceKind kind, const std::string& name) {
  return kind == InterfaceKind::kAction ? "the action " + name : name;
}

}  // namespace

void TypeLacks::tell(Link& link) {
  Offer offer;
  for (const auto& [key, topic] : side_.graph.topics()) {
    if (!topic.lack || topic.publishers.empty() || has_action_token(key.first)) continue;
    add({InterfaceKind::kTopic, key.first, key.first, key.second, key.second, *topic.lack}, link,
        offer.lacking);
  }
  for (const auto& [key, service] : side_.graph.services()) {
    if (!service.lack || has_action_token(key.first)) continue;
    if (side_.claims.serves(service_gid(key.first))) continue;  // another bridge's
    add({InterfaceKind::kService, key.first, key.first, key.second, key.second, *service.lack},
        link, offer.lacking);
  }
  for (const auto& [name, action] : side_.actions.lacked())
    add({InterfaceKind::kAction, name, name_of_part(name, ActionPart::kSendGoal), action.type,
         type_of_part(action.type, ActionPart::kSendGoal), action.lack},
        link, offer.lacking);
  if (!offer.lacking.empty()) link.send(offer);
}

void TypeLacks::add(const Found& found, Link& link, std::vector<LackTold>& lacking) {
  std::set<std::string>& told = told_[link.id];
  if (told.contains(found.type)) return;
  const auto wire_part = side_.graph_options.names.to_wire(found.part);
  if (!wire_part) return;
  const bool is_action = found.kind == InterfaceKind::kAction;
  const Interface what{is_action ? InterfaceKind::kService : found.kind, *wire_part,
                       found.part_type,
                       is_action ? std::string_view{found.type} : std::string_view{}};
  if (!side_.policy.decide(Direction::kExport, what, link.identity)) return;
  if (!link.accepts->takes(what).value_or(false)) return;
  if (side_.outputs.told().first("type_lacking " + found.type))
    side_.outputs.log(LogLevel::kWarn, "cannot export " + shown_name(found.kind, found.name) +
                                           ": " + found.lack.reason);
  if (told.size() >= kLacksMax) return;
  told.insert(found.type);
  const auto part = part_of_action(what.kind, what.name, what.type);
  lacking.push_back({found.kind, is_action && part ? std::string(part->action) : *wire_part,
                     found.type, found.lack.code, found.lack.reason});
}

void TypeLacks::on_told(const Link& link, const std::vector<LackTold>& lacking) {
  for (const LackTold& told : lacking) {
    if (told.kind == InterfaceKind::kOther) continue;
    if (!side_.policy.decide(Direction::kImport, told.kind, told.name, told.type, link.identity))
      continue;
    if (!link.account->told.first("type_lacking " + told.type)) continue;
    side_.outputs.log(LogLevel::kWarn, link.label() + " cannot export " +
                                           shown_name(told.kind, told.name) +
                                           ", and says: " + told.reason + " (" + told.code + ")");
  }
}

}  // namespace connect_bridge
