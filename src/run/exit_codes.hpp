// Exit codes of `server`, `client` and `ctl`.
#pragma once

namespace connect_bridge {

// Code 0: an orderly end, --help or --version.
inline constexpr int kExitRos = 1;         // ROS does not start
inline constexpr int kExitNotAllowed = 1;  // `ctl explain`: nothing of the question is allowed
// The configuration or the invitation is wrong, or the port cannot be opened.
inline constexpr int kExitConfiguration = 2;
inline constexpr int kExitFailed = 3;  // stopped by an error, or because the loop stood still

}  // namespace connect_bridge
