// The first bytes of a connection to a relay.
#pragma once

#include <functional>
#include <memory>
#include <utility>

#include "net/tcp/proxy_header.hpp"
#include "net/tcp/transport.hpp"
#include "net/tls/client_hello.hpp"

namespace connect_bridge {

// Reads the ClientHello, and before it a trusted proxy's header of the PROXY protocol; no byte
// beyond. Thread: that of the io_context.
class RelayArrival {
 public:
  enum class State : std::uint8_t {
    kHello,
    kNothing,
    kWrong
  };  // kNothing: it ended without a byte
  struct Events {
    std::function<void(const Source&)> from;  // for whom the proxy connects, if it says so
    std::function<void(State)> read;          // once
  };

  explicit RelayArrival(TcpSocket socket) : socket_(std::move(socket)) {}
  // Closed or moved away at any time.
  [[nodiscard]] TcpSocket& socket() { return socket_; }
  // Once. `owner`: of this, which is there while something is read.
  void read(bool from_proxy, std::shared_ptr<void> owner, Events events);

  // After kHello: as they came, and what they say.
  [[nodiscard]] Bytes& bytes() { return hello_; }
  [[nodiscard]] const ClientHello& hello() const { return said_; }

 private:
  void read_proxy(const std::shared_ptr<void>& owner);
  void read_hello(const std::shared_ptr<void>& owner);
  void more(const std::shared_ptr<void>& owner, Bytes& bytes, std::size_t missing,
            void (RelayArrival::*then)(const std::shared_ptr<void>&));

  TcpSocket socket_;
  Events events_;
  Bytes header_, hello_;
  ClientHello said_;
};

}  // namespace connect_bridge
