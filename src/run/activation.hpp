// Sockets that systemd has opened for this process (sd_listen_fds(3), without its library).
#pragma once

#include <string>
#include <vector>

namespace connect_bridge {

struct PassedSockets {
  std::vector<int> sockets;
  std::string problem;  // empty: there is at least one
};

// `pid`: of this process; `sockets_for` and `count`: LISTEN_PID and LISTEN_FDS, which may be empty.
// At most 8.
[[nodiscard]] PassedSockets passed_sockets(int pid, const std::string& sockets_for,
                                           const std::string& count);

}  // namespace connect_bridge
