// Whether an offer of a peer may exist here, for topics and services alike.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "core/graph/side_view.hpp"
#include "core/link/link.hpp"
#include "core/policy/policy.hpp"
#include "core/ports/audit.hpp"

namespace connect_bridge {

// The decision of the rules here; nullopt: no rule allows it. All rights of imports are decided
// here; only the search for the cause of a missing name (MissingNames) asks the rules itself.
[[nodiscard]] std::optional<Decision> import_right(const SideView& side, const Link& link,
                                                   const Interface& what);
// The same by the local name. For /parameter_events: whether the events of any node are allowed;
// withholds_events() judges each node.
[[nodiscard]] std::optional<Decision> import_right(const SideView& side, const Link& link,
                                                   InterfaceKind kind,
                                                   const std::pair<std::string, std::string>& key,
                                                   const std::string& action_type);
// Whether no rule lets the peer publish the parameter events of this node (its name on the wire).
[[nodiscard]] bool withholds_events(const SideView& side, const Link& link,
                                    const std::string& node);

// An offer of a peer that may exist here.
struct Import {
  std::pair<std::string, std::string> key;  // local name, type
  Decision decision;
};
// Judges an offer. nullopt: it is not permitted, and was declined.
[[nodiscard]] std::optional<Import> judge(const SideView& side, Link& link,
                                          const ChannelOffer& offer);
// Declines an offer. Messages on its channel are dropped: the channel has no owner until it is
// withdrawn.
void decline(const SideView& side, Link& link, const ChannelOffer& offer, const std::string& code,
             const std::string& reason);

// The proxy node that owns the mirror of an endpoint of the peer's `node` (a name on the wire).
// Null: our own node owns it, because no proxies are wanted, the node has no name yet, or the
// identity has too many of them, which is logged once.
[[nodiscard]] ProxyNames::Hold take_proxy_node(const SideView& side, const Link& link,
                                               const std::string& node);

// Writes lines of the audit log: the channel is imported by this rule, or its import ends.
void note_import(const SideView& side, const Link& link, const ChannelOffer& offer,
                 const std::string& rule);
void note_import_end(const SideView& side, const Link& link, InterfaceKind kind,
                     const std::pair<std::string, std::string>& key, const std::string& rule,
                     const Ending& why);
// The reason for an import that ends because rules have changed.
inline Ending no_longer_permitted() {
  return {"no rule allows importing it any longer", "not_permitted"};
}

}  // namespace connect_bridge
