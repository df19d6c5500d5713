// The client's half of a handshake: the way to the server, TLS, upgrade.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "core/ports/net_options.hpp"
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
  using Done = std::function<void(std::shared_ptr<WebSocket>, std::string problem)>;

  // `tls`: for a secure URL; if it is null for one, nothing is dialed, and the caller gives the
  // reason by cancel().
  Dialing(asio::io_context& io, DialOptions options, SocketOptions sockets, TlsContext tls);
  ~Dialing();
  // `done` is called once, never from inside start().
  void start(Done done);
  // Cancels: `done` is called with this problem, soon.
  void cancel(std::string problem);
  // Cancels; `done` is not called.
  void abandon();
  // Whether it came so far that there is somebody: TLS or HTTP began.
  [[nodiscard]] bool answered() const { return stage_ != nullptr; }
  // Whether its time ended without that.
  [[nodiscard]] bool was_silent() const { return was_silent_; }
  // Whether the server has another key than those that are pinned.
  [[nodiscard]] bool met_other_key() const { return met_other_key_; }
  // See Way.
  [[nodiscard]] const std::optional<asio::ip::address>& tried() const { return way_->tried(); }

 private:
  struct Response;

  void on_deadline();
  void on_connected(TcpSocket socket);
  void start_tls();
  void on_tls(const ErrorCode& error);
  void upgrade();
  void on_upgraded(const ErrorCode& error);
  [[nodiscard]] std::string upgrade_problem(const ErrorCode& error) const;
  void fail(const std::string& problem);
  void finish(std::shared_ptr<WebSocket> socket, std::string problem);

  asio::io_context& io_;
  DialOptions options_;
  SocketOptions sockets_;
  asio::steady_timer deadline_;  // of the whole dial
  const std::shared_ptr<Way> way_;
  TlsContext tls_;
  std::shared_ptr<WebSocket> socket_;
  std::unique_ptr<Response> response_;
  const char* stage_ = nullptr;  // what is being waited for; null: the way
  bool was_silent_ = false;
  bool met_other_key_ = false;
  Done done_;
};

}  // namespace connect_bridge
