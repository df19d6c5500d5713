// The client's half of a handshake: the way to the server, TLS, upgrade.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/ports/failure.hpp"
#include "core/ports/net_options.hpp"
#include "net/tcp/traffic.hpp"
#include "net/tcp/transport.hpp"
#include "net/tls/tls.hpp"
#include "net/tls/way.hpp"

namespace connect_bridge {

struct WebSocket;

// The name that the server's certificate must carry, where it decides, and that the handshake has.
[[nodiscard]] std::string server_name(const DialOptions& options);

class Dialing : public std::enable_shared_from_this<Dialing> {
 public:
  // The open WebSocket, or null and why not.
  using Done = std::function<void(std::shared_ptr<WebSocket>, Failure why)>;

  // `tls`: for a secure URL; if it is null for one, nothing is dialed, and the caller gives the
  // reason by cancel().
  Dialing(asio::io_context& io, DialOptions options, SocketOptions sockets, TlsContext tls);
  ~Dialing();
  // Before start(): what shows a relay that we know the robot, and a server that we have logged in
  // there. Anybody on the way can read it.
  void show(std::vector<std::string> words) { words_ = std::move(words); }
  // `done` is called once, never from inside start().
  void start(Done done);
  // Cancels: `done` is called with this failure, soon.
  void cancel(Failure why);
  // Cancels; `done` is not called.
  void abandon();
  // Whether its time ended before TLS or HTTP began.
  [[nodiscard]] bool was_silent() const { return was_silent_; }
  // See Way.
  [[nodiscard]] const std::optional<asio::ip::address>& tried() const { return way_->tried(); }
  // Traffic of a dial that has failed or was abandoned. Who gets the socket counts its traffic.
  [[nodiscard]] const Traffic& traffic() const { return traffic_; }

 private:
  struct Response;

  void on_deadline();
  void on_connected(TcpSocket socket);
  void start_tls();
  void on_tls(const ErrorCode& error);
  void upgrade();
  void on_upgraded(const ErrorCode& error);
  [[nodiscard]] Failure upgrade_failure(const ErrorCode& error) const;
  [[nodiscard]] Failure failure_by(const ErrorCode& error) const;
  // Whether not one byte has come on this connection.
  [[nodiscard]] bool heard_nothing() const;
  // Closes the socket, if there is one.
  void abort();
  void fail(const Failure& why);
  void finish(std::shared_ptr<WebSocket> socket, Failure why);

  asio::io_context& io_;
  DialOptions options_;
  SocketOptions sockets_;
  asio::steady_timer deadline_;  // of the whole dial
  const std::shared_ptr<Way> way_;
  TlsContext tls_;
  std::vector<std::string> words_;
  std::shared_ptr<WebSocket> socket_;
  std::unique_ptr<Response> response_;
  Traffic traffic_;              // of a socket that is closed
  const char* stage_ = nullptr;  // what is being waited for; null: the way
  bool was_silent_ = false;
  Done done_;
};

}  // namespace connect_bridge
