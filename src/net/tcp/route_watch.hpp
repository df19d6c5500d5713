// Reports changes of the machine's addresses or routes: Wi-Fi goes, LTE comes, a cable is pulled.
#pragma once

#include <array>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <string>

#include "net/tcp/transport.hpp"

namespace connect_bridge {

// Receives the kernel's messages by rtnetlink(7). If that is forbidden, nothing is reported, and
// open() returns the reason. Thread: that of the io_context.
class RouteWatch : public std::enable_shared_from_this<RouteWatch> {
 public:
  // `changed` is called some 100 ms after a change, and at most once a second.
  RouteWatch(boost::asio::io_context& io, std::function<void()> changed);

  // Starts to watch; call this once. Returns the reason why no changes will be noticed; empty:
  // none.
  [[nodiscard]] std::string open();

 private:
  void listen();
  void on_readable(ErrorCode error);
  void tell_soon();
  void tell();

  boost::asio::posix::stream_descriptor netlink_;
  boost::asio::steady_timer timer_;
  std::function<void()> changed_;
  bool will_tell_ = false;
  std::chrono::steady_clock::time_point reported_at_{};
  std::array<char, 16384> buffer_{};
};

// The address that the socket is bound to, if none of the machine's interfaces has it any more:
// then nothing can arrive. Empty: an interface has it, or this is not known.
[[nodiscard]] std::string lost_address(const TcpSocket& socket);

}  // namespace connect_bridge
