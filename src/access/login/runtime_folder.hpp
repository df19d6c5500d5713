// Where programs of one user find each other's sockets.
#pragma once

#include <string>
#include <vector>

namespace connect_bridge {

// $RUNTIME_DIRECTORY (systemd's), $XDG_RUNTIME_DIR/connect_bridge, /run/user/UID/connect_bridge, or
// /tmp/connect_bridge-UID: the first that can be. It is made for this user alone. Empty with
// `problem` set: none can be made that nobody else may change.
[[nodiscard]] std::string make_runtime_folder(std::string& problem);

// "/robot1/connect_server" of the process 17 is "FOLDER/robot1.connect_server-17.status".
[[nodiscard]] std::string status_socket(const std::string& folder, const std::string& node);

// The sockets of programs that run, in every folder in which one of this user may be and that
// nobody else may change, and in those of the system's units (/run/connect_bridge*). What a
// program has left that ended without an end is removed.
[[nodiscard]] std::vector<std::string> status_sockets();

}  // namespace connect_bridge
