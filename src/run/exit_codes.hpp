// How `server`, `client` and `ctl` exit.
#pragma once

namespace connect_bridge {

// 0 is an orderly end, --help or --version.
inline constexpr int kExitRos = 1;         // ROS does not start
inline constexpr int kExitNotAllowed = 1;  // `ctl explain`: nothing that was asked is allowed
// The configuration, or the invitation, is wrong, or the port cannot be opened.
inline constexpr int kExitConfiguration = 2;
inline constexpr int kExitFailed = 3;  // an error, or a loop that stood still, ended it

}  // namespace connect_bridge
