// The findings that the ends of a link tell each other.
#pragma once

#include <algorithm>
#include <iterator>
#include <string_view>

namespace connect_bridge {

// Findings about what crosses the link, and about the path. Rules, files and logins are each side's
// own.
inline constexpr std::string_view kForPeers[] = {
    "drops_rate",         "drops_max_age",
    "stamps_old",         "clocks_differ",
    "publisher_ahead",    "drops_too_large",
    "drops_memory",       "link_too_thin",
    "own_limit",          "qos",
    "path_loses",         "path_full",
    "loop_slow",          "lost_in_middleware",
    "nothing_arrives",    "service_silent",
    "calls_refused",      "calls_wait",
    "published_here_too", "path_too_long",
    "two_of_one_driver",  "urgent_is_heavy",
    "path_slow",          "server_ends",
    "several_servers",    "halts_nothing",
    "lost_in_bursts",     "publisher_stops",
};

// A peer's other words are not shown: people would take them for this side's.
[[nodiscard]] inline bool is_for_peers(std::string_view id) {
  return std::find(std::begin(kForPeers), std::end(kForPeers), id) != std::end(kForPeers);
}

}  // namespace connect_bridge
