// A line of the audit log as JSON (docs/security.md, "The audit log").
#pragma once

#include <chrono>
#include <string>

#include "core/ports/audit.hpp"
#include "ops/audit/audit_book.hpp"

namespace connect_bridge {

// A time in UTC by RFC 3339: "2026-11-22T16:30:00.123Z".
[[nodiscard]] std::string rfc3339(std::chrono::system_clock::time_point time);

// One line with its end. For any content of the strings, the result is one line of printable ASCII:
// JSON escapes the rest, invalid UTF-8 is replaced, and a string is cut off after 512 bytes.
[[nodiscard]] std::string to_line(const Audit& audit, std::chrono::system_clock::time_point time);
// The line with the number of an identity's lines that are missing before it.
[[nodiscard]] std::string to_line(const AuditBook::LeftOut& left_out,
                                  std::chrono::system_clock::time_point time);

}  // namespace connect_bridge
