// How the programs and `ctl` end; 0 is an orderly end.
#pragma once

namespace connect_bridge {

inline constexpr int kExitRos = 1;            // ROS does not start
inline constexpr int kExitNotAllowed = 1;     // `ctl explain`: nothing that was asked is allowed
inline constexpr int kExitConfiguration = 2;  // the configuration, or the invitation, is wrong
inline constexpr int kExitFailed = 3;         // an error, or a loop that stood still, ended it

}  // namespace connect_bridge
