// Lines of text over TLS: the control connection between a robot and its relay.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "core/base/bytes.hpp"
#include "net/tcp/traffic.hpp"
#include "net/tcp/transport.hpp"
#include "net/tls/tls.hpp"

namespace connect_bridge {

// Thread: that of the io_context. The owner limits the time.
class TlsLines : public std::enable_shared_from_this<TlsLines> {
 public:
  // May end the object from inside.
  struct Events {
    std::function<void(std::string_view)> line;     // without its end
    std::function<void(const Failure& why)> ended;  // once, nothing follows
  };

  TlsLines(TcpSocket socket, TlsContext context);
  ~TlsLines();

  [[nodiscard]] SSL* tls();
  [[nodiscard]] TcpSocket& socket() { return socket_; }
  // Bytes of the connection, also after its end.
  [[nodiscard]] Traffic traffic();
  // Once. `read_before`: what of the peer's handshake was read from the socket already.
  void shake_hands(bool as_server, Bytes read_before, std::function<void(ErrorCode)> done);
  // Once, after the handshake. `line_max`: with its end; a longer one ends the connection.
  void open(std::size_t line_max, Events events);
  void limit_lines(std::size_t line_max) { line_max_ = line_max; }
  // Without its end. Who does not read what is said is cut off.
  void say(const std::string& line);
  // Closes the connection when all lines are written: at once, where they fit into the socket's
  // buffer; else there is no limit for it.
  void finish();
  // Closes it at once; no callback is called any more.
  void end();

 private:
  struct Stream;

  void read();
  void on_read(const ErrorCode& error, std::size_t bytes);
  void write();
  void fail(const Failure& why);

  static constexpr std::size_t kUnsentMax = 65536;

  TcpSocket socket_;
  TlsContext context_;  // outlives the stream
  std::unique_ptr<Stream> stream_;
  std::function<void(ErrorCode)> shaken_;
  Bytes read_before_;
  Events events_;
  std::size_t line_max_ = 0;
  std::string line_;  // and what was read beyond it
  std::string unsent_, sending_;
  bool finishes_ = false;
  Traffic traffic_;  // of a connection that is closed
};

}  // namespace connect_bridge
