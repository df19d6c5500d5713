// Facts about this machine that matter when the bridge is slow or silent.
#pragma once

#include <string>

namespace connect_bridge {

// Lines "name: value": system, memory, kernel settings of sockets and fragments, shared memory,
// network interfaces with their MTU, limits of this process, variables that ROS reads. No line has
// an interface's address or the machine's name.
[[nodiscard]] std::string system_facts();

}  // namespace connect_bridge
