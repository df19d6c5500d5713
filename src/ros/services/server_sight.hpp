// Whether a service has a server, from what the middleware reports from moment to moment.
#pragma once

#include <chrono>
#include <optional>

#include "core/base/time.hpp"

namespace connect_bridge::ros {

// The middleware reports no server while it knows one endpoint of a server and not yet the other:
// also when a second server comes beside one that works (rmw_service_server_is_available() of
// rmw_fastrtps compares the numbers of readers and writers). Calls that are under way would be lost
// for nothing, so who had a server is not alone at once.
class ServerSight {
 public:
  using Time = std::chrono::steady_clock::time_point;

  // A server counts as gone when requests reached none for this time, and the graph has none.
  static constexpr Duration kPatience = std::chrono::milliseconds(75);
  // The time while the graph still has a server. It is longer than two heartbeats (3 s each), with
  // which Fast DDS announces again what was lost.
  static constexpr Duration kPatienceInGraph = std::chrono::seconds(10);

  // reached: requests reach a server now; in_graph: the graph has one, perhaps half of it.
  // Returns whether is_ready() has changed.
  bool look(bool reached, bool in_graph, Time now);

  // Whether it has a server. The first one is believed at once.
  [[nodiscard]] bool is_ready() const { return ready_; }
  // Whether no server was reached at the last look.
  [[nodiscard]] bool is_alone() const { return missing_since_.has_value(); }
  // The time until the next look, while the server is ready and may go soon; else nullopt.
  [[nodiscard]] std::optional<Duration> next_look() const;

 private:
  bool ready_ = false;
  Duration patience_ = kPatience;
  std::optional<Time> missing_since_;
};

}  // namespace connect_bridge::ros
