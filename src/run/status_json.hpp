// The status of a side as JSON, for the status file (docs/config.md, `status_file`).
#pragma once

#include <optional>
#include <string>

#include "core/ports/net_options.hpp"
#include "core/ports/status.hpp"
#include "net/network.hpp"
#include "ros/counters.hpp"
#include "run/audit_log.hpp"

namespace connect_bridge {

// What the run layer adds to the core's status.
struct RunStatus {
  std::string time;     // when it was so (RFC 3339)
  bool running = true;  // false: it has ended
  std::string node;
  Role role = Role::kServer;
  double loop_lag_ms = 0;  // longest delay of the loop in the last second
  ros::GatewayCounters ros = {};
  NetworkCounts network = {};
  Traffic traffic = {};                        // since the start
  std::optional<AuditLog::Counts> audit = {};  // none: there is no audit log
  std::string version = {};
  std::string started = {};                  // RFC 3339
  std::string certificate_valid_until = {};  // RFC 3339; empty: this side shows none that ends
};

std::string to_json(const Status& status, const RunStatus& run);

}  // namespace connect_bridge
