// The service manager that has started this process (sd_notify(3) and sd_listen_fds(3), without its
// library).
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/local/datagram_protocol.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace connect_bridge {

// Sockets that it has opened for this process.
struct PassedSockets {
  std::vector<int> sockets;
  std::string problem;  // empty: there is at least one
};

// `pid`: of this process; `sockets_for` and `count`: LISTEN_PID and LISTEN_FDS, which may be empty.
// At most 8.
[[nodiscard]] PassedSockets passed_sockets(int pid, const std::string& sockets_for,
                                           const std::string& count);

// systemd, or what speaks like it. Nothing here blocks, and nobody learns of a failure: the bridge
// runs the same without a supervisor. Thread: that of the io_context.
class Supervisor {
 public:
  // `address`: NOTIFY_SOCKET, the path of a socket, or @ and an abstract name. Nothing is sent if
  // it is empty, of another kind, or longer than the address of a socket may be.
  Supervisor(boost::asio::io_context& io, std::string address);

  // Once a second while the loop moves, the first time when the bridge is open: says that, once,
  // and that the watchdog need not bite.
  void every_second();
  // An orderly end has begun.
  void stopping();

 private:
  // Whether the text is in the queue of the supervisor.
  bool tell(std::string_view text);

  boost::asio::local::datagram_protocol::socket socket_;
  boost::asio::local::datagram_protocol::endpoint there_;
  bool knows_start_ = false;
};

}  // namespace connect_bridge
