// Lines of the audit log about a link and its channels. Nothing is made if there is no audit log.
#pragma once

#include <string>
#include <utility>

#include "core/link/link.hpp"
#include "core/ports/outputs.hpp"

namespace connect_bridge {

inline Audit audit_of(const Link& link, AuditEvent event) {
  Audit line;
  line.event = event;
  line.link = link.id;
  line.identity = link.identity.name;
  line.address = link.address;
  line.node = link.node;
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

// With the groups that rules may ask for.
inline void audit_login(Outputs& outputs, const Link& link, AuditEvent event) {
  if (!outputs.audits()) return;
  Audit line = audit_of(link, event);
  line.groups = link.identity.groups;
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

}  // namespace connect_bridge
