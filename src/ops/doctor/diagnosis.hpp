// From what is seen to its cause: for `ctl doctor`. Pure functions of values.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "config/config.hpp"
#include "core/base/json.hpp"
#include "core/ports/failure.hpp"
#include "ops/doctor/findings.hpp"

namespace connect_bridge {

// The finding of a cause, with the failure's text as what was seen.
[[nodiscard]] Found diagnose(const Failure& failure);
// Odd settings in a valid file.
[[nodiscard]] std::vector<Found> diagnose_config(const Config& config);
// A running side, by its status (docs/status.md).
[[nodiscard]] std::vector<Found> diagnose_status(const Json& status);

// The variables that count of the environment of a process, by name; and its user.
struct ProcessFacts {
  std::map<std::string, std::string> variables;
  unsigned user = 0;
};
// A running side, and the shell in which its operator stands.
[[nodiscard]] std::vector<Found> diagnose_processes(const ProcessFacts& side,
                                                    const ProcessFacts& shell);

struct MachineFacts {
  std::string congestion_controls;             // that are allowed, with blanks between them
  std::uint64_t shared_memory_free_bytes = 0;  // of /dev/shm
};
[[nodiscard]] std::vector<Found> diagnose_machine(const MachineFacts& machine);

}  // namespace connect_bridge
