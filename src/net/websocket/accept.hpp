// The server's half of a handshake: TLS, HTTP request, upgrade or a refusal that a person can read.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/bytes.hpp"
#include "net/tcp/transport.hpp"
#include "net/websocket/listener.hpp"

namespace connect_bridge {

// A connection on its way to become a WebSocket, and a part of its listener, which it informs of
// its end: by on_open() or on_refused(), unless abandon() was first.
class Listener::Visitor : public std::enable_shared_from_this<Visitor> {
 public:
  Visitor(Listener& listener, TcpSocket socket, ConnectionOpened opened, By sender);
  ~Visitor();
  Visitor(const Visitor&) = delete;
  Visitor& operator=(const Visitor&) = delete;

  void start();
  // The turn of this connection has come: its handshake has its whole time, however long it has
  // waited.
  void begin();
  // Closes at once; the listener hears nothing more of it.
  void abandon();

  // The first protocols that its ClientHello offers, as far as this has come.
  [[nodiscard]] std::vector<std::string> offered() const;

  // Until its end, if it became no WebSocket.
  [[nodiscard]] const Traffic& traffic() const { return traffic_.total(); }

  ConnectionOpened from;
  const By by;
  std::shared_ptr<Admission::Pending> slot;
  std::shared_ptr<Admission::Pending> relay_slot;  // of those who come by the relay
  std::shared_ptr<WebSocket> socket;
  std::shared_ptr<void> place;  // among the open connections
  std::string notice;           // what may be wrong with proxies or their list; empty: nothing

 private:
  struct Request;

  void read_proxy();
  void line_up();
  void await_hello();
  void look_for_hello();
  // The connection begins with a header of the PROXY protocol that is not expected of it.
  void note_header();
  void read_forwarded();
  void on_tls(const ErrorCode& error);
  void read_request();
  void on_request(const ErrorCode& error);
  void upgrade();
  void answer_plain_http();
  void refuse(unsigned status, const std::string& text);
  void on_answered(const ErrorCode& error);
  void fail(const std::string& problem);
  // The listener, which hears of the end, and of nothing after it.
  Listener* end();
  // Closes it, and gives its places back.
  void abort();
  void count_traffic();  // while it is open
  void set_deadline(std::chrono::milliseconds time);
  void on_deadline();

  Listener* listener_;  // null: it has ended
  std::unique_ptr<Request> request_;
  Bytes proxy_header_;
  asio::steady_timer deadline_;
  TrafficMeter traffic_;
  std::string problem_;  // why it is being refused
};

}  // namespace connect_bridge
