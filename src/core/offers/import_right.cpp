#include "core/offers/import_right.hpp"

#include "core/link/link_audit.hpp"
#include "core/policy/interface.hpp"

namespace connect_bridge {
namespace {

using Key = std::pair<std::string, std::string>;

std::optional<Decision> right_by_name(const SideView& side, const Link& link,
                                      const Interface& what) {
  if (is_parameter_events(what.kind, what.name))
    return side.policy.decide_parameter_events(Direction::kImport, what.type,
                                               link.login.identity());
  return import_right(side, link, what);
}

}  // namespace

std::optional<Decision> import_right(const SideView& side, const Link& link,
                                     const Interface& what) {
  return side.policy.decide(Direction::kImport, what, link.login.identity());
}

std::optional<Decision> import_right(const SideView& side, const Link& link, InterfaceKind kind,
                                     const Key& key, const std::string& action_type) {
  const auto wire_name = link.names.to_wire(key.first);
  if (!wire_name) return std::nullopt;
  return right_by_name(side, link, {kind, *wire_name, key.second, action_type});
}

bool withholds_events(const SideView& side, const Link& link, const std::string& node) {
  return !import_right(side, link,
                       {InterfaceKind::kTopic, kParameterEvents, kParameterEventType, {}, node});
}

std::optional<Import> judge(const SideView& side, Link& link, const ChannelOffer& offer) {
  const auto no = [&](const std::string& code, const std::string& reason) {
    decline(side, link, offer, code, reason);
    return std::nullopt;
  };
  // Offers of an unknown kind are declined before any other field is read: a later version may have
  // defined it (docs/protocol.md section 15).
  const bool is_topic = offer.kind == InterfaceKind::kTopic;
  if (!is_topic && offer.kind != InterfaceKind::kService)
    return no("unsupported", "such channels are not forwarded");
  // Names and types reach rules, logs and the local graph, so they are checked before any other
  // use.
  if (!is_canonical_name(offer.name) ||
      !(is_topic ? is_topic_type(offer.type) : is_service_type(offer.type)))
    return no("not_permitted", "the name or type is not canonical");
  const Interface what{offer.kind, offer.name, offer.type, offer.action_type};
  auto decision = right_by_name(side, link, what);  // mutant: import_right
  if (!decision) return no("not_permitted", "no rule allows importing " + offer.name);
  // `remap` may give two names of the wire the same name here. They would share a mirror, though
  // the rules judge each by its own name.
  Key key{link.names.to_local(offer.name), offer.type};
  if (link.names.to_wire(key.first) != offer.name)
    return no("not_permitted", "another name is mapped to its name here");
  return Import{std::move(key), *std::move(decision)};
}

void decline(const SideView& side, Link& link, const ChannelOffer& offer, const std::string& code,
             const std::string& reason) {
  audit(side.outputs, link, AuditEvent::kChannelRefused,
        {Direction::kImport, offer.kind, offer.name, offer.type, {}}, reason, code);
  link.decline(offer.channel, offer.kind, {link.names.to_local(offer.name), offer.type},
               {reason, code});
}

ProxyNames::Hold take_proxy_node(const SideView& side, const Link& link, const std::string& node) {
  const std::string name = side.graph_options.owner_of(node, link.names);
  if (name.empty()) return nullptr;
  auto hold = link.account->proxy_nodes.take(name);
  if (!hold)
    side.outputs.log_once(link.account->logged, LogLevel::kWarn,
                          link.label() + " has endpoints of more than " +
                              std::to_string(ProxyNames::kMost) +
                              " nodes: those of further nodes belong to the node of this program");
  return hold;
}

void note_import(const SideView& side, const Link& link, const ChannelOffer& offer,
                 const std::string& rule) {
  audit(side.outputs, link, AuditEvent::kChannelOpened,
        {Direction::kImport, offer.kind, offer.name, offer.type, rule});
}

void note_import_end(const SideView& side, const Link& link, InterfaceKind kind, const Key& key,
                     const std::string& rule, const Ending& why) {
  if (!side.outputs.audits()) return;
  audit(side.outputs, link, AuditEvent::kChannelEnded,
        {Direction::kImport, kind, link.names.wire_name(key.first), key.second, rule}, why.reason,
        why.code);
}

}  // namespace connect_bridge
