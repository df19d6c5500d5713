// Folder in which programs of one user find each other's sockets.
#pragma once

#include <string>
#include <vector>

namespace connect_bridge {

// Makes the first of these folders that can be made, for this user alone: $RUNTIME_DIRECTORY
// (systemd's), $XDG_RUNTIME_DIR/connect_bridge, /run/user/UID/connect_bridge, or
// /tmp/connect_bridge-UID. Empty with `problem` set: another user may change each of them, or it
// cannot be made.
[[nodiscard]] std::string make_runtime_folder(std::string& problem);

// The file of a socket: "/robot1/connect_server" of process 17 has
// "FOLDER/robot1.connect_server-17.status".
[[nodiscard]] std::string status_socket(const std::string& folder, const std::string& node);

// Folders in `run` (/run) that only the system and their owners change: those of units among them,
// each with the name that its unit gives (RuntimeDirectory). Root sees into all of them, another
// user into its own.
[[nodiscard]] std::vector<std::string> folders_of_units(const std::string& run);

// Sockets of running programs, in every possible folder of this user that nobody else may change,
// and those that it may connect to in the folders of the system's units, below `run`. Removes
// sockets that crashed programs have left in the former.
[[nodiscard]] std::vector<std::string> status_sockets(const std::string& run = "/run");

// For a person whose programs are not found: the folders of status_sockets(), and sockets of
// programs in others, as the kernel lists those that are bound. A program that was started with
// another environment has its socket there, or another user's.
[[nodiscard]] std::string where_sockets_are(const std::string& bound = "/proc/net/unix");

}  // namespace connect_bridge
