#include "core/types/type_lacks.hpp"

#include <utility>

#include "core/policy/interface.hpp"

namespace connect_bridge {
namespace {

std::string shown_name(InterfaceKind kind, const std::string& name) {
  return kind == InterfaceKind::kAction ? "the action " + name : name;
}

}  // namespace

TypeLacks::Lacking TypeLacks::lacking_for(const Link& link) const {
  Lacking lacking;
  for (const auto& [key, topic] : side_.graph.topics()) {
    if (!topic.lack || topic.publishers.empty() || has_action_token(key.first)) continue;
    add({InterfaceKind::kTopic, key.first, key.first, key.second, key.second, *topic.lack}, link,
        lacking);
  }
  for (const auto& [key, service] : side_.graph.services()) {
    if (!service.lack || has_action_token(key.first)) continue;
    if (side_.claims.serves(service_gid(key.first))) continue;  // another bridge's
    add({InterfaceKind::kService, key.first, key.first, key.second, key.second, *service.lack},
        link, lacking);
  }
  // An action is told as a whole, under its own name and type; its rights are those of any part,
  // here of the one for goals.
  for (const auto& [name, action] : side_.actions.lacked())
    add({InterfaceKind::kAction, name, name_of_part(name, ActionPart::kSendGoal), action.type,
         type_of_part(action.type, ActionPart::kSendGoal), action.lack},
        link, lacking);
  return lacking;
}

void TypeLacks::add(const Found& found, const Link& link, Lacking& lacking) const {
  if (lacking.contains(found.type)) return;
  const auto wire_part = side_.graph_options.names.to_wire(found.part);
  if (!wire_part) return;
  const bool is_action = found.kind == InterfaceKind::kAction;
  const Interface what{is_action ? InterfaceKind::kService : found.kind, *wire_part,
                       found.part_type,
                       is_action ? std::string_view{found.type} : std::string_view{}};
  if (!side_.policy.decide(Direction::kExport, what, link.login.identity())) return;
  // What is not compared yet is told later: this is asked again when it is (Side::recheck).
  if (!link.accepts || !link.accepts->takes(what).value_or(false)) return;
  const auto part = part_of_action(what.kind, what.name, what.type);
  LackTold told{found.kind, is_action && part ? std::string(part->action) : *wire_part, found.type,
                found.lack.code, found.lack.reason};
  lacking[found.type] = {shown_name(found.kind, found.name), std::move(told)};
}

void TypeLacks::tell(Link& link) {
  std::set<std::string>& told = told_[link.id];
  Offer offer;
  for (auto& [type, found] : lacking_for(link)) {
    auto& [shown, lack] = found;
    if (told.contains(type)) continue;
    if (side_.outputs.told().first("type_lacking " + type))
      side_.outputs.log(LogLevel::kWarn, "cannot export " + shown + ": " + lack.reason);
    // A peer takes no more on a connection (docs/protocol.md section 12); this side's own log is
    // complete.
    if (told.size() >= kLacksMax) continue;
    told.insert(type);
    offer.lacking.push_back(std::move(lack));
  }
  if (!offer.lacking.empty()) link.send(offer);
}

void TypeLacks::on_link_lost(LinkId link) {
  told_.erase(link);
  heard_.erase(link);
}

void TypeLacks::on_offer(const Link& link, const Offer& offer) {
  if (const auto heard = heard_.find(link.id); heard != heard_.end())
    for (const ChannelOffer& channel : offer.channels)
      heard->second.erase(channel.action_type.empty() ? channel.type : channel.action_type);
  for (const LackTold& told : offer.lacking) on_told(link, told);
}

void TypeLacks::on_told(const Link& link, const LackTold& told) {
  if (told.kind == InterfaceKind::kOther) return;
  // The peer must not write names into this side's log and status that no rule here lets it offer.
  // The number of types, and with it of lines, is bounded as well.
  if (!side_.policy.decide(Direction::kImport, told.kind, told.name, told.type,
                           link.login.identity()))
    return;
  const std::string shown = shown_name(told.kind, told.name);
  auto& heard = heard_[link.id];
  if (heard.size() < kLacksMax) heard[told.type] = {shown, told.type, false, told.reason};
  if (!link.account->told.first("type_lacking " + told.type)) return;
  side_.outputs.log(LogLevel::kWarn, link.label() + " cannot export " + shown +
                                         ", and says: " + told.reason + " (" + told.code + ")");
}

void TypeLacks::add_status(const Link& link, LinkStatus& status) const {
  for (auto& [type, found] : lacking_for(link))
    status.lacking.push_back({found.first, type, true, found.second.reason});
  if (const auto heard = heard_.find(link.id); heard != heard_.end())
    for (const auto& [type, lack] : heard->second) status.lacking.push_back(lack);
}

}  // namespace connect_bridge
