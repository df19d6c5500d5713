// The status of a side at one moment, of the core and of what runs it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/time.hpp"
#include "core/ports/net_options.hpp"
#include "core/ports/status.hpp"
#include "net/relay/place_at_relay.hpp"
#include "net/websocket/network.hpp"
#include "ops/audit/audit_log.hpp"
#include "ros/entities/counters.hpp"

namespace connect_bridge {

// Parameter files that were changed while the program ran, and refused.
struct RefusedParameters {
  std::string time;  // RFC 3339
  std::string problem;
};

// The worst, or the growth, of the last minutes (lately.hpp).
struct SideLately {
  double loop_lag_ms = 0;
  std::uint64_t held_up = 0;  // seconds in which the loop was held up
  std::uint64_t refused = 0;  // before a login
  std::uint64_t wrong_logins = 0;
  std::uint64_t logins_not_judged = 0;
  std::uint64_t shared_bytes = 0;
};

// The run layer's addition to the core's status.
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
  std::string started = {};               // RFC 3339
  Stamp certificate_end = 0;              // 0: this side shows none that ends
  std::vector<std::string> listens = {};  // a server's addresses: "127.0.0.1:9090"
  std::vector<PlaceAtRelay> relays = {};
  std::optional<RefusedParameters> refused_parameters = {};  // since the last that was accepted
  std::vector<std::string> refused_files = {};  // of tokens and TLS: why they are not used
  std::string status_file_problem = {};         // empty: it is written, or there is none
  std::vector<std::string> needs_restart = {};  // keys that differ in the files by now
  bool is_robot = true;                         // this end, and not the peer
  std::string prefix = {};                      // the key
  std::optional<SideLately> lately = {};
};

// A small number for each link that there is, for names that must not come without end.
// The lowest that is free is given: those of links that have ended serve again.
class LinkPlaces {
 public:
  // The links that there are now.
  void follow(const std::vector<LinkStatus>& links);
  // From 1 on; of a link of the last follow().
  [[nodiscard]] std::size_t of(const LinkStatus& link) const;

 private:
  std::vector<std::uint64_t> places_;  // the number of the link there; 0: free
};

// The status of a side at one moment; nobody changes it.
struct StatusPicture {
  Status side;
  RunStatus run;
  LinkPlaces places = {};  // of its links
};

}  // namespace connect_bridge
