// The status of a side as JSON, for the status file (docs/config.md, `status_file`).
#pragma once

#include <optional>
#include <string>

#include "core/ports/status.hpp"
#include "net/door_counts.hpp"
#include "net/traffic.hpp"
#include "run/audit_log.hpp"

namespace connect_bridge {

// What the run layer adds to the core's status.
struct RunStatus {
  std::string node;
  std::string role;         // "server" or "client"
  double loop_lag_ms = 0;   // longest delay of the loop in the last second
  std::uint64_t taken = 0;  // samples taken from ROS
  std::uint64_t published = 0;
  std::uint32_t types_not_installed = 0;  // in use, those of requests and responses counted
  Traffic today = {}, this_month = {};
  std::optional<AuditLog::Counts> audit = {};  // none: there is no audit log
  std::optional<DoorCounts> doors = {};        // a server's
  std::uint32_t types_described = 0;           // of the types not installed, by a peer
  std::uint64_t held = 0;                      // times that a peer sent more than is read of it
  std::uint64_t extra_frames = 0;              // WebSocket frames beyond one a message
};

std::string to_json(const Status& status, const RunStatus& run);

}  // namespace connect_bridge
