// Events that an operator may want to know later: logins, granted rights, and actions of peers.
// docs/security.md section "The audit log".
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/ids.hpp"
#include "core/policy/policy.hpp"
#include "core/wire/control.hpp"
#include "core/wire/words.hpp"

namespace connect_bridge {

enum class AuditEvent : std::uint8_t {
  kStarted,  // of this side, as kStopped
  kStopped,
  kRulesChanged,  // the operator's change is in force
  kRulesRefused,  // the operator's change is refused
  kLogin,         // a connection carries a link from now on
  kRefused,       // a connection was closed before its login
  kLinkLost,      // a connection that carried a link has ended
  kRenewed,       // the login of a link was renewed
  kRenewalRefused,
  kRightsChanged,   // the login method reports other groups or another end of a login
  kRevoked,         // the login method withdrew the login
  kChannelOpened,   // rules here allow it; exported: the peer accepts it
  kChannelRefused,  // imported: by rules or limits here; exported: by the peer
  kChannelEnded,    // while the link goes on
  kDemanded,        // the peer receives an exported topic from now on
  kDemandEnded,
  kCall,  // of a peer; the service here gets it now
  kGoal,  // the same for an action
  kCallRefused,
  kGoalCancelled,  // by this side: the link that sent it is lost
  kWheelTaken,     // a peer steers a topic from now on
  kHalted,         // this side said zero in place of who steers
  kWheelLeft,
};

// The words of the audit log.
inline constexpr std::array<Word<AuditEvent>, 23> kAuditWords{{
    {AuditEvent::kStarted, "started"},
    {AuditEvent::kStopped, "stopped"},
    {AuditEvent::kRulesChanged, "rules_changed"},
    {AuditEvent::kRulesRefused, "rules_refused"},
    {AuditEvent::kLogin, "login"},
    {AuditEvent::kRefused, "refused"},
    {AuditEvent::kLinkLost, "link_lost"},
    {AuditEvent::kRenewed, "renewed"},
    {AuditEvent::kRenewalRefused, "renewal_refused"},
    {AuditEvent::kRightsChanged, "rights_changed"},
    {AuditEvent::kRevoked, "revoked"},
    {AuditEvent::kChannelOpened, "channel_opened"},
    {AuditEvent::kChannelRefused, "channel_refused"},
    {AuditEvent::kChannelEnded, "channel_ended"},
    {AuditEvent::kDemanded, "demanded"},
    {AuditEvent::kDemandEnded, "demand_ended"},
    {AuditEvent::kCall, "call"},
    {AuditEvent::kGoal, "goal"},
    {AuditEvent::kCallRefused, "call_refused"},
    {AuditEvent::kGoalCancelled, "goal_cancelled"},
    {AuditEvent::kWheelTaken, "wheel_taken"},
    {AuditEvent::kHalted, "halted"},
    {AuditEvent::kWheelLeft, "wheel_left"},
}};

struct AuditChannel {
  Direction direction = Direction::kExport;
  InterfaceKind kind = InterfaceKind::kTopic;
  std::string name;  // on the wire; for a goal: the action's
  std::string type;
  std::string rule;  // the rule that opened it; empty: none, or unknown here
};

struct AuditOptions {
  std::string file;  // empty: there is no audit log
  // Refuses a call or goal of a peer that cannot be recorded.
  bool required = false;
};

// One line of the audit log. Texts of a peer are unchanged, with sizes bounded by the protocol: the
// writer turns them into valid text.
struct Audit {
  AuditEvent event = AuditEvent::kStarted;
  LinkId link = {};  // none: before the login, or without a peer
  std::string identity = {};
  std::string address = {};
  std::string node = {};
  std::vector<std::string> groups = {};
  std::optional<AuditChannel> channel = {};
  std::string code = {};    // a word of the protocol
  std::string reason = {};  // for people
};

}  // namespace connect_bridge
