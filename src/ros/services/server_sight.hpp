// Decides whether a service has a server, from momentary reports of the middleware.
#pragma once

#include <chrono>
#include <optional>

#include "core/base/time.hpp"

namespace connect_bridge::ros {

// The middleware reports no server while it knows one endpoint of a server but not the other. This
// also happens when a second server starts beside one that works (rmw_service_server_is_available()
// of rmw_fastrtps compares the numbers of readers and writers). Calls under way would be lost for
// nothing, so a server does not count as gone at once.
class ServerSight {
 public:
  using Time = std::chrono::steady_clock::time_point;

  // A server counts as gone if requests have reached none for this time, and the graph has none.
  static constexpr Duration kPatience = std::chrono::milliseconds(75);
  // The same time while the graph still has a server. This exceeds two heartbeats (3 s each), by
  // which Fast DDS repeats lost announcements.
  static constexpr Duration kPatienceInGraph = std::chrono::seconds(10);

  // `reached`: requests reach a server now; `in_graph`: the graph has one, perhaps half of it. True
  // if is_ready() has changed.
  bool look(bool reached, bool in_graph, Time now);

  // The service has a server. The first sight of a server counts at once.
  [[nodiscard]] bool is_ready() const { return ready_; }
  // No server was reached at the last look.
  [[nodiscard]] bool is_alone() const { return missing_since_.has_value(); }
  // The time until the next look, while the server is ready and may go soon; otherwise nullopt.
  [[nodiscard]] std::optional<Duration> next_look() const;

 private:
  bool ready_ = false;
  Duration patience_ = kPatience;
  std::optional<Time> missing_since_;
};

}  // namespace connect_bridge::ros
