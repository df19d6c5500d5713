// Sockets on which a program listens, by TCP or at a file, and the connections that arrive there.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/base/log_limit.hpp"
#include "core/ports/ports.hpp"
#include "net/tcp/transport.hpp"

namespace connect_bridge {

// A connection without room waits in the kernel; one that would take a descriptor of files is
// closed (net/tcp/descriptors.hpp). Thread: that of the io_context.
class TcpDoors : public std::enable_shared_from_this<TcpDoors> {
 public:
  struct Events {
    std::function<void(TcpSocket)> arrived;
    std::function<void(LogLevel, const std::string&)> log;
  };

  // `port_key`: the parameter that sets the port.
  TcpDoors(asio::io_context& io, Events events, std::string port_key = "listen.port")
      : io_(io), events_(std::move(events)), port_key_(std::move(port_key)) {}

  // Listens on addresses, or takes sockets that listen already: one of both, as ListenOptions has
  // them. Returns the problem; empty: none. The address of a VPN or a mobile network may appear
  // after this program has started: it is accepted with a warning, and clients connect as soon as
  // an interface has it. A port in use is a problem.
  [[nodiscard]] std::string open(std::vector<std::string> addresses, std::uint16_t port);
  [[nodiscard]] std::string take(const std::vector<int>& sockets);
  // Listens at a socket file that only this process's user may use, and replaces an existing one.
  // Returns the problem; empty: none.
  [[nodiscard]] std::string open_file(const std::string& file);
  // Accepts connections from now on.
  void accept();
  void close();  // no event follows

  // The port of the first address.
  [[nodiscard]] std::uint16_t port() const;
  // The addresses with their ports: "127.0.0.1:9090", "[::1]:9090".
  [[nodiscard]] std::vector<std::string> addresses() const;

 private:
  struct Door {
    explicit Door(asio::io_context& io) : acceptor(io), retry(io) {}
    asio::ip::tcp::acceptor acceptor;
    asio::steady_timer retry;
  };
  using DoorPtr = std::shared_ptr<Door>;

  // Adds an IP address, or "localhost". Returns the problem; empty: none.
  std::string bind(const std::string& address, std::uint16_t port);
  // Adds a socket that listens already. Returns the problem; empty: none.
  std::string use(int socket, const asio::ip::tcp& family);
  void accept(const DoorPtr& door);
  void on_accepted(const DoorPtr& door, ErrorCode error, TcpSocket socket);

  asio::io_context& io_;
  Events events_;
  const std::string port_key_;
  std::vector<DoorPtr> doors_;
  LogLimit no_room_;
};

}  // namespace connect_bridge
