// The client's half of a handshake: look up the name, connect, ask a proxy, TLS, upgrade.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "net/options.hpp"
#include "net/tls.hpp"
#include "net/transport.hpp"

namespace connect_bridge {

struct WebSocket;

class Dialing : public std::enable_shared_from_this<Dialing> {
 public:
  // The open WebSocket, or null and why not.
  using Done = std::function<void(std::shared_ptr<WebSocket>, std::string problem)>;

  // `tls`: for a secure URL; if it is null then, nothing is dialed, and cancel() has to tell why.
  Dialing(asio::io_context& io, DialOptions options, SocketOptions sockets, TlsContext tls);
  ~Dialing();
  // `done` is called once, never from inside start().
  void start(Done done);
  // Gives up: `done` is called with this problem, soon.
  void cancel(std::string problem);
  // Gives up without a word.
  void abandon();

 private:
  struct Response;
  using Endpoint = asio::ip::tcp::endpoint;

  void resolve();
  void connect_next();
  void on_connected(const Endpoint& endpoint, const ErrorCode& error);
  void ask_proxy();
  void enter();
  void start_tls();
  void on_tls(const ErrorCode& error);
  void upgrade();
  void on_upgraded(const ErrorCode& error);
  [[nodiscard]] std::string upgrade_problem(const ErrorCode& error) const;
  [[nodiscard]] std::string server_name() const;
  void fail(const std::string& problem);
  void finish(std::shared_ptr<WebSocket> socket, std::string problem);

  asio::io_context& io_;
  DialOptions options_;
  SocketOptions sockets_;
  asio::ip::tcp::resolver resolver_;
  asio::steady_timer deadline_;      // of the whole dial
  asio::steady_timer attempt_;       // of one address
  std::vector<Endpoint> endpoints_;  // the next to try first
  std::size_t attempts_ = 0;
  std::chrono::steady_clock::time_point end_;
  TlsContext tls_;
  std::shared_ptr<WebSocket> socket_;
  std::unique_ptr<Response> response_;
  std::string stage_;  // what is being waited for
  Done done_;
};

}  // namespace connect_bridge
