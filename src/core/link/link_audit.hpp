// Lines of the log and of the audit log about a link and its channels. No line of the audit log is
// made if there is none.
#pragma once

#include <string>
#include <utility>

#include "core/link/link.hpp"
#include "core/ports/outputs.hpp"
#include "core/wire/text.hpp"

namespace connect_bridge {

inline Audit audit_of(const Link& link, AuditEvent event) {
  Audit line;
  line.event = event;
  line.link = link.id;
  line.identity = link.login.identity().name;
  line.address = link.peer().address;
  line.node = link.peer().node;
  return line;
}

inline void audit(Outputs& outputs, const Link& link, AuditEvent event, const std::string& reason,
                  std::string_view code = {}) {
  if (!outputs.audits()) return;
  Audit line = audit_of(link, event);
  line.reason = reason;
  line.code = code;
  outputs.push(std::move(line));
}

// The line includes the groups that rules may name.
inline void audit_login(Outputs& outputs, const Link& link, AuditEvent event) {
  if (!outputs.audits()) return;
  Audit line = audit_of(link, event);
  line.groups = link.login.identity().groups;
  outputs.push(std::move(line));
}

inline void audit(Outputs& outputs, const Link& link, AuditEvent event, AuditChannel channel,
                  const std::string& reason = {}, std::string_view code = {}) {
  if (!outputs.audits()) return;
  Audit line = audit_of(link, event);
  line.channel = std::move(channel);
  line.reason = reason;
  line.code = code;
  outputs.push(std::move(line));
}

// The peer declines a channel of `what`, and why: `declined` keeps that. Logged the first time of a
// channel, later at a limited rate, and nothing twice.
inline void log_decline(Outputs& outputs, const Link& link, Ending& declined,
                        const std::string& what, const Decline& decline, const Now& now) {
  std::string reason = decline.reason.empty() ? "no reason given" : decline.reason;
  declined.code = decline.code;
  if (declined.reason == reason) return;
  const std::string line = link.label() + " does not import " + what + ", and says: " + reason +
                           " (" + decline.code + ")";
  const bool again = !std::exchange(declined.reason, std::move(reason)).empty();
  if (again ? link.account->declines.count(now).has_value() : link.account->logged.first(line))
    outputs.log(LogLevel::kWarn, line);
}

// Logs once that the peer withdraws a channel of `what`, if it gives a reason.
inline void log_withdrawn(Outputs& outputs, const Link& link, const std::string& what,
                          const Withdraw& withdraw) {
  if (withdraw.code.empty()) return;
  outputs.log_once(link.account->logged, LogLevel::kWarn,
                   link.label() + " cannot export " + what + ", and says: " + withdraw.reason +
                       " (" + withdraw.code + ")");
}

struct TypeDifference {
  std::string what;  // "/pose of /talker"
  std::string type;  // "geometry_msgs/msg/Pose"
  std::string hash_here, hash_there;
  bool used = false;  // the rules use it nevertheless (allow_type_mismatch)
};

// Logs that a type has one definition here and another one at the peer. Logged once for each type
// and hash of an identity, however many interfaces have the type. A type that is used nevertheless
// has a line of its own.
inline void log_difference(Outputs& outputs, const Link& link, const TypeDifference& difference) {
  const std::string& type = difference.type;
  const std::string key = difference.used ? "type_mismatch_used " : "type_mismatch ";
  if (!link.account->logged.first(key + type + " " + difference.hash_there)) return;
  const std::string text = difference.what + ": the definition of " + type + " here (" +
                           shown_hash(difference.hash_here) + ") is not that of " + link.label() +
                           " (" + shown_hash(difference.hash_there) + "). ";
  if (difference.used)
    return outputs.log(LogLevel::kWarn,
                       text + "Messages that do not fit the definition here are dropped");
  outputs.log(LogLevel::kError, "cannot mirror " + text + "Install the same version of " +
                                    type.substr(0, type.find('/')) +
                                    " on both sides, or set allow_type_mismatch in the rule");
}

}  // namespace connect_bridge
