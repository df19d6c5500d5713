// From what is seen to its cause: for `ctl doctor`. Pure functions of values.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
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
// The finding of a server that cannot listen at its port. `listener`: the user of who listens
// there, if it is known: another user's program may be this server.
[[nodiscard]] Found diagnose_port(const Failure& failure, std::optional<std::uint32_t> listener,
                                  std::uint32_t user);
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

// Programs in one domain get one line of `domain_differs`. Programs in several domains get none:
// a machine with two graphs is meant so.
void gather_domains(const std::vector<ProgramFacts>& programs, std::vector<Found>& found);

// Variables that change whom a middleware finds, beside the domain and the range.
inline constexpr const char* kMiddlewareVariables[] = {
    "ROS_DISCOVERY_SERVER",           "ROS_STATIC_PEERS",           "FASTDDS_DEFAULT_PROFILES_FILE",
    "FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_BUILTIN_TRANSPORTS", "CYCLONEDDS_URI",
    "ZENOH_SESSION_CONFIG_URI",       "ZENOH_CONFIG_OVERRIDE",
};

// Whether the value of such a variable is a configuration itself, which may hold a password: XML,
// JSON or KEY=VALUE, and not a file or a list of addresses.
[[nodiscard]] bool holds_configuration(std::string_view value);

// The variables that count of the environment of a process, by name; and its user.
struct ProcessFacts {
  std::map<std::string, std::string> variables;
  unsigned user = 0;
};
// A running side, and the shell in which its operator stands.
[[nodiscard]] std::vector<Found> diagnose_processes(const ProcessFacts& side,
                                                    const ProcessFacts& shell);
// Whether its group used up its processor time in most periods, by its cpu.stat (cgroup v2).
[[nodiscard]] std::vector<Found> diagnose_throttling(const std::string& cpu_stat);
// The shell itself.
[[nodiscard]] std::vector<Found> diagnose_shell(const ProcessFacts& shell);

struct MachineFacts {
  std::string congestion_controls;             // that are allowed, with blanks between them
  std::uint64_t shared_memory_free_bytes = 0;  // of /dev/shm
  bool loses = false;                          // a link here loses packets, or is too thin
};
[[nodiscard]] std::vector<Found> diagnose_machine(const MachineFacts& machine);

}  // namespace connect_bridge
