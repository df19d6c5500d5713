// TCP connection to a server, directly or through an HTTP proxy.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "core/ports/failure.hpp"
#include "core/ports/url.hpp"
#include "net/tcp/look_up.hpp"
#include "net/tcp/race.hpp"
#include "net/tcp/transport.hpp"

namespace connect_bridge {

// Looks up the name, connects to the first address that answers, then sends CONNECT to a proxy (RFC
// 9110 section 9.3.6), whose answer has 8 KiB of header at most. With a proxy the name and
// addresses are the proxy's, and the proxy looks up the server's. The caller limits the time.
// Thread: that of the io_context.
class Way : public std::enable_shared_from_this<Way> {
 public:
  // The connected socket, or none and why.
  using Done = std::function<void(std::optional<TcpSocket>, const Failure& why)>;

  // `host`: name or address literal, IPv6 without its brackets.
  // `slow`: see Race.
  Way(asio::io_context& io, std::string host, std::uint16_t port, std::optional<HttpProxy> proxy,
      bool slow = false);
  ~Way();
  // Once only. `done` is called once, never from inside.
  void start(Done done);
  // `done` is not called any more.
  void stop();
  // Why there is no socket yet, if there is no answer in time.
  [[nodiscard]] Failure silence() const;
  // The first address, once it is known.
  [[nodiscard]] const std::optional<asio::ip::address>& tried() const { return tried_; }
  // " (10.9.0.77)": the addresses of the name, or the one that answered, for people. Empty while
  // they are unknown, and for an address literal.
  [[nodiscard]] const std::string& led_to() const { return led_to_; }

 private:
  struct Asking;

  void race(const std::vector<Race::Endpoint>& addresses);
  void note_answer(const TcpSocket& socket);
  void ask_proxy(TcpSocket socket);
  void on_asked(const ErrorCode& error);
  void on_answered(const ErrorCode& error);
  void finish(std::optional<TcpSocket> socket, const Failure& why);
  // The failure that this error means: kProxyUnreachable, where there is a proxy.
  [[nodiscard]] Failure failure_by(const ErrorCode& error, const std::string& name) const;

  const std::string host_;
  const std::uint16_t port_;
  const std::optional<HttpProxy> proxy_;
  LookUp look_up_;
  const std::shared_ptr<Race> race_;
  std::unique_ptr<Asking> asking_;  // null: no proxy is asked yet
  std::optional<asio::ip::address> tried_;
  std::string led_to_;
  Failure silence_{Cause::kResolverSilent, "the name look-up"};  // what is being waited for
  Done done_;
};

}  // namespace connect_bridge
