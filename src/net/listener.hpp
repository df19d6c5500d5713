// Accepts TCP connections, admits some, and hands over those that became WebSockets.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>

#include "core/base/pace.hpp"
#include "core/ports/ports.hpp"
#include "net/accept.hpp"
#include "net/admission.hpp"
#include "net/options.hpp"
#include "net/tls_files.hpp"

namespace connect_bridge {

class Listener : public std::enable_shared_from_this<Listener> {
 public:
  struct Arrival {
    std::shared_ptr<WebSocket> socket;
    std::string peer;
    std::shared_ptr<Admission::Pending> pending_slot;
    std::shared_ptr<void> connection_slot;
  };
  struct Events {
    std::function<void(Arrival)> arrived;
    std::function<void(LogLevel, std::string)> log;
  };

  Listener(asio::io_context& io, SocketOptions sockets, Events events);

  // Empty, or what is wrong. Once only.
  [[nodiscard]] std::string open(const ListenOptions& options);
  // Accepts no more and drops handshakes; no event follows.
  void close();

  // Reads certificates that have changed: for handshakes that begin from now on. Once a second.
  void check_files();

  // Of the first address.
  [[nodiscard]] std::uint16_t port() const;
  // "127.0.0.1:9090", "[::1]:9090"
  [[nodiscard]] std::vector<std::string> addresses() const;
  [[nodiscard]] std::uint64_t accepted() const { return accepted_; }
  [[nodiscard]] std::uint64_t refused() const { return refused_; }
  [[nodiscard]] std::size_t pending() const { return acceptances_.size(); }

 private:
  // A connection on its way to become a WebSocket.
  struct Visitor {
    std::string peer;           // for logs and for the core
    asio::ip::address address;  // whom limits count
    std::shared_ptr<Admission::Pending> slot;
  };
  using Acceptor = asio::ip::tcp::acceptor;
  using Endpoint = asio::ip::tcp::endpoint;

  // One listening socket.
  struct Door {
    explicit Door(asio::io_context& io) : acceptor(io), retry(io) {}
    Acceptor acceptor;
    asio::steady_timer retry;
  };
  using DoorPtr = std::shared_ptr<Door>;

  // Empty, or what is wrong.
  std::string open_doors(const ListenOptions& options);
  std::string take_socket(int socket);
  std::string bind(const std::string& address, std::uint16_t port);
  void accept(const DoorPtr& door);
  void on_accepted(const DoorPtr& door, const ErrorCode& error, TcpSocket socket);
  void admit(TcpSocket socket);
  // Whether a handshake may begin with this address; then it counts.
  bool take_handshake(const std::string& key, int share);
  void accept_at(const DoorPtr& door, TimePoint when);
  void start(TcpSocket socket, std::shared_ptr<Visitor> visitor, bool from_proxy);
  void drop(TcpSocket& socket, const std::string& why);
  // A proxy tells for whom it connects, or nothing; false: that one has begun too many handshakes.
  bool identify(Visitor& visitor, const std::optional<Source>& source);
  void on_done(const std::shared_ptr<Acceptance>& acceptance, Visitor& visitor, Accepted accepted);
  void log(LogLevel level, const std::string& text);
  // Perhaps an operator's mistake, but strangers can cause it too: logged at a limited rate.
  void log_notice(const Visitor& visitor, const std::string& notice);

  asio::io_context& io_;
  SocketOptions sockets_;
  Events events_;
  std::vector<DoorPtr> doors_;
  std::shared_ptr<Admission> admission_;
  std::shared_ptr<const AcceptOptions> options_;
  std::optional<TlsFiles> tls_;
  std::unordered_set<std::shared_ptr<Acceptance>> acceptances_;
  std::unordered_map<std::string, Pace> paces_;  // of handshakes, by address
  Pace pace_{1, Duration::zero()};               // of all of them
  int spare_ = 0;  // handshakes that may begin at other doors while one of them waits for its turn
  ListenOptions limits_;
  std::uint64_t accepted_ = 0;
  std::uint64_t refused_ = 0;
  bool tuning_told_ = false;
  Pace notices_{1, std::chrono::minutes{10}};
};

}  // namespace connect_bridge
