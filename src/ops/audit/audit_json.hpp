// A line of the audit log as JSON (docs/security.md, "The audit log").
#pragma once

#include <chrono>
#include <string>

#include "core/ports/audit.hpp"
#include "ops/audit/audit_book.hpp"

namespace connect_bridge {

// "2026-11-22T16:30:00.123Z", UTC (RFC 3339).
[[nodiscard]] std::string rfc3339(std::chrono::system_clock::time_point time);

// One line with its end. Whatever the strings contain, the result is one line of printable ASCII:
// JSON escapes the rest, bytes that are no UTF-8 are replaced, and a string is cut off after 512
// bytes.
[[nodiscard]] std::string to_line(const Audit& audit, std::chrono::system_clock::time_point time);
// The line that says how many lines of somebody are missing before it.
[[nodiscard]] std::string to_line(const AuditBook::LeftOut& left_out,
                                  std::chrono::system_clock::time_point time);

}  // namespace connect_bridge
