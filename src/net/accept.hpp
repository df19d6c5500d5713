// The server's half of a handshake: TLS, HTTP request, upgrade or a refusal that a person can read.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/ports/net_options.hpp"
#include "net/proxy_header.hpp"
#include "net/tls.hpp"
#include "net/transport.hpp"

namespace connect_bridge {

struct WebSocket;

struct AcceptOptions {
  TlsContext tls;  // null: plain
  std::chrono::milliseconds timeout{};
  AddressRanges proxies;
  ToldBy told_by = ToldBy::kXForwardedFor;
  // A slot among the open connections, null when all are taken.
  std::function<std::shared_ptr<void>()> reserve;
};

struct Accepted {
  std::shared_ptr<WebSocket> socket;  // null: refused or failed
  std::shared_ptr<void> slot;
  std::string problem;
  std::string notice;  // what may be wrong with proxies or their list; empty: nothing
};

class Acceptance : public std::enable_shared_from_this<Acceptance> {
 public:
  using Done = std::function<void(Accepted)>;

  // Gets the address for which the proxy connects, if the proxy has sent it. Returns whether the
  // connection may go on.
  using Identify = std::function<bool(const std::optional<Source>&)>;
  // Called when the connection waits for its turn: begin() is to be called then.
  using AwaitTurn = std::function<void(const std::shared_ptr<Acceptance>&)>;

  // `identify`: for a connection from a trusted proxy, else empty.
  Acceptance(TcpSocket socket, std::shared_ptr<const AcceptOptions> options, Identify identify,
             AwaitTurn await_turn);
  ~Acceptance();
  // `done` is called once, when the WebSocket is open or the socket is closed.
  void start(Done done);
  // Its turn has come. What it has waited does not count: it has all of the time for its handshake.
  void begin();
  // Closes at once; `done` is not called.
  void abandon();

 private:
  struct Request;

  void read_proxy();
  void line_up();
  bool identified(const std::optional<Source>& source);
  bool read_forwarded();
  void notice_unheard();
  void on_tls(const ErrorCode& error);
  void read_request();
  void on_request(const ErrorCode& error);
  void upgrade();
  void answer_plain_http();
  void refuse(unsigned status, const std::string& text);
  void fail(std::string problem);
  void finish(Accepted accepted);
  void set_deadline(std::chrono::milliseconds time);

  std::shared_ptr<const AcceptOptions> options_;
  std::shared_ptr<WebSocket> socket_;
  std::unique_ptr<Request> request_;
  Identify identify_;
  AwaitTurn await_turn_;
  Bytes proxy_header_;
  boost::asio::steady_timer deadline_;
  std::shared_ptr<void> slot_;
  std::string problem_;
  std::string notice_;
  Done done_;
};

}  // namespace connect_bridge
