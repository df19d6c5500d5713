// A line of the audit log as JSON (docs/security.md, "The audit log").
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "core/ports/audit.hpp"

namespace connect_bridge {

// "2026-11-22T16:30:00.123Z", UTC (RFC 3339).
[[nodiscard]] std::string rfc3339(std::chrono::system_clock::time_point time);

// One line with its end. Whatever the strings contain, the result is one line of printable ASCII:
// JSON escapes the rest, bytes that are no UTF-8 are replaced, and a string is cut off after 512
// bytes. `times`: how often it happened since `time`, if more than once.
[[nodiscard]] std::string to_line(const Audit& audit, std::chrono::system_clock::time_point time,
                                  std::uint64_t times = 1);
// The line that says how many lines are missing before it.
[[nodiscard]] std::string line_of_lost(std::uint64_t count,
                                       std::chrono::system_clock::time_point time);

}  // namespace connect_bridge
