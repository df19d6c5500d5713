#include "core/ports/audit.hpp"

namespace connect_bridge {

std::string_view name_of(AuditEvent event) {
  switch (event) {
    case AuditEvent::kStarted: return "started";
    case AuditEvent::kStopped: return "stopped";
    case AuditEvent::kRulesChanged: return "rules_changed";
    case AuditEvent::kRulesRefused: return "rules_refused";
    case AuditEvent::kLogin: return "login";
    case AuditEvent::kRefused: return "refused";
    case AuditEvent::kLinkLost: return "link_lost";
    case AuditEvent::kRenewed: return "renewed";
    case AuditEvent::kRenewalRefused: return "renewal_refused";
    case AuditEvent::kRightsChanged: return "rights_changed";
    case AuditEvent::kRevoked: return "revoked";
    case AuditEvent::kChannelOpened: return "channel_opened";
    case AuditEvent::kChannelRefused: return "channel_refused";
    case AuditEvent::kChannelEnded: return "channel_ended";
    case AuditEvent::kDemanded: return "demanded";
    case AuditEvent::kDemandEnded: return "demand_ended";
    case AuditEvent::kCall: return "call";
    case AuditEvent::kGoal: return "goal";
    case AuditEvent::kCallRefused: return "call_refused";
  }
  return "unknown";
}

}  // namespace connect_bridge
