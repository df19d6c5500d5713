// The service manager that has started this process (sd_notify(3) and sd_listen_fds(3), without its
// library).
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/local/datagram_protocol.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace connect_bridge {

// Sockets that the service manager has opened for this process.
struct PassedSockets {
  std::vector<int> sockets;
  std::string problem;  // empty: there is at least one socket
};

// `pid`: this process; `sockets_for` and `count`: LISTEN_PID and LISTEN_FDS, which may be empty. At
// most 8 sockets.
[[nodiscard]] PassedSockets passed_sockets(int pid, const std::string& sockets_for,
                                           const std::string& count);

// systemd, or a service manager with the same protocol. Nothing here blocks, and failures are not
// reported: the bridge runs the same without a supervisor. Runs on the thread of the io_context.
class Supervisor {
 public:
  // `address`: NOTIFY_SOCKET, the path of a socket, or @ and an abstract name. Nothing is sent if
  // it is empty, of another kind, or longer than a socket address may be.
  Supervisor(boost::asio::io_context& io, std::string address);

  // Call it once a second while the loop moves, and first when the bridge is open. Sends READY
  // until the supervisor has taken it, and WATCHDOG each time.
  void every_second();
  // Reports that an orderly stop has begun.
  void stopping();

 private:
  // True if the supervisor's queue took the text.
  bool tell(std::string_view text);

  boost::asio::local::datagram_protocol::socket socket_;
  boost::asio::local::datagram_protocol::endpoint there_;
  bool knows_start_ = false;
};

}  // namespace connect_bridge
