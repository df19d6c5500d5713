// From what is seen to its cause: for `ctl doctor`. Pure functions of values.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "config/config.hpp"
#include "core/ports/failure.hpp"
#include "ops/doctor/findings.hpp"

namespace connect_bridge {

// The id of the finding of a cause.
[[nodiscard]] std::string_view finding_for(Cause cause);
// The finding of a cause, with the failure's text as what was seen.
[[nodiscard]] Found diagnose(const Failure& failure);
// Odd settings in a valid file.
[[nodiscard]] std::vector<Found> diagnose_config(const Config& config);

// A running program of this machine.
struct ProgramFacts {
  std::string node;
  std::string domain;
  int process = 0;
  std::set<std::string> brings = {};  // topics, into the graph of its domain
};
[[nodiscard]] std::vector<Found> diagnose_programs(const std::vector<ProgramFacts>& programs);

// Variables that change whom a middleware finds, beside the domain and the range.
inline constexpr const char* kMiddlewareVariables[] = {
    "ROS_DISCOVERY_SERVER",           "ROS_STATIC_PEERS",           "FASTDDS_DEFAULT_PROFILES_FILE",
    "FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_BUILTIN_TRANSPORTS", "CYCLONEDDS_URI",
    "ZENOH_SESSION_CONFIG_URI",       "ZENOH_CONFIG_OVERRIDE",
};

// The variables that count of the environment of a process, by name; and its user.
struct ProcessFacts {
  std::map<std::string, std::string> variables;
  unsigned user = 0;
};
// A running side, and the shell in which its operator stands.
[[nodiscard]] std::vector<Found> diagnose_processes(const ProcessFacts& side,
                                                    const ProcessFacts& shell);
// The shell itself.
[[nodiscard]] std::vector<Found> diagnose_shell(const ProcessFacts& shell);

struct MachineFacts {
  std::string congestion_controls;             // that are allowed, with blanks between them
  std::uint64_t shared_memory_free_bytes = 0;  // of /dev/shm
  bool loses = false;                          // a link here loses packets, or is too thin
};
[[nodiscard]] std::vector<Found> diagnose_machine(const MachineFacts& machine);

}  // namespace connect_bridge
