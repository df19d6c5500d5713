// Options of the network layer: `config` reads them, `run` adds what is computed. Every limit has a
// default.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/base/time.hpp"
#include "core/ports/url.hpp"

namespace connect_bridge {

// A server listens, a client connects.
enum class Role : std::uint8_t { kServer, kClient };

// TLS of a server or a client. Files are PEM. The first two are given together or not at all.
struct TlsOptions {
  std::string certificate_file{};  // the whole chain, our own certificate first
  std::string private_key_file{};
  // The trusted authorities. Empty: a client trusts the system's authorities; a server requests no
  // client certificates. Otherwise every client of the server must show one.
  std::string ca_file{};
  // Client: SHA-256 of the public keys (SPKI) that the server may have, in base64; empty: any. With
  // pins and without `ca_file` the key alone decides: name, dates and authority are not checked. A
  // pin may also give the identity of such a server for rules: see Pin.
  std::vector<std::string> pins{};
  bool pins_by_invitation = false;  // the pins come from a pairing; used in messages
  // The reason, for people, why somebody else may change a file; such a file is not used. Empty:
  // nobody may. Null: files are not checked.
  std::string (*distrusted)(const std::string& file) = nullptr;

  bool operator==(const TlsOptions&) const = default;
};

// Treatment of every TCP connection.
struct SocketOptions {
  // TCP_NOTSENT_LOWAT: the next packet is pulled only while fewer bytes than this wait unsent in
  // the kernel. So urgent data overtakes at the last moment (docs/flow.md). 0: the kernel's own
  // limit; then every packet leaves at once.
  std::uint32_t unsent_bytes_max = 16384;
  // Bytes that a client masks and sends in one step.
  std::uint32_t write_buffer_bytes = 128 << 10;
  // "bbr", "cubic", ...; "auto": chosen for the path (CongestionChoice); empty or "host": the
  // host's
  std::string congestion_control;
  // Messages read from a connection per second. Beyond this limit reading pauses, and the sender
  // has to wait. A burst of receive_burst passes at once.
  std::int64_t receive_packets_per_second = 50'000;
  std::chrono::milliseconds receive_burst{4000};
  std::chrono::milliseconds user_timeout{20000};  // unacknowledged data closes the connection
  std::chrono::seconds keepalive{15};             // first probe after this idle time; 0: off
};

// The form in which a proxy gives the client's address. Only one form is used: a header that the
// proxy does not write itself may come from the client unchanged.
enum class NamedBy : std::uint8_t { kXForwardedFor, kProxyProtocol };

// A server that no client can reach waits at a relay for its clients.
struct RelayOptions {
  Url url;         // includes the name of the robot that this server has there
  TlsOptions tls;  // `ca_file` and `pins` of the relay
  std::function<std::string()> token{};  // read at each login; empty: there is no token now
  std::string code{};  // from the registration command, for the first login; may be empty
  // Called at the first welcome of the relay. Returns an error text, or nothing. May be empty.
  std::function<std::string()> keep{};
};

struct ListenOptions {
  // Literals; "::" takes IPv6 and IPv4, "*" takes all that the host has.
  std::vector<std::string> addresses{"127.0.0.1"};
  std::uint16_t port = 9090;  // 0: any free one, see Network::listen_port()
  // Listening TCP sockets that this process was given, in place of `addresses` and `port`. The
  // listener owns them from now on.
  std::vector<int> sockets;
  std::optional<TlsOptions> tls;
  std::optional<RelayOptions> relay;  // needs `tls`
  // Addresses and ranges ("10.0.0.0/8") of proxies that are trusted to give the client's address:
  // limits per address then use that. With NamedBy::kProxyProtocol all their connections must begin
  // with such a header; connections of others must not.
  std::vector<std::string> trusted_proxies;
  NamedBy named_by = NamedBy::kXForwardedFor;
  bool proxies_only = false;         // connections of others are dropped
  std::size_t connections_max = 64;  // further ones get HTTP 503
  // Addresses of the loopback have this many times the limits of others: a proxy there stands for
  // many clients.
  static constexpr int kLoopbackShare = 8;
  // Connections without a login, of all and of one address; beyond: the oldest is dropped.
  std::size_t pending_max = 320;
  std::size_t pending_per_address_max = 16;
  // TLS handshakes of one address; further ones are dropped. And of all; further ones wait for a
  // turn.
  int address_handshakes_at_once = 30;
  Duration address_handshake_period = std::chrono::milliseconds(100);
  int handshakes_at_once = 150;
  Duration handshake_period = std::chrono::milliseconds(20);
  std::chrono::milliseconds handshake_timeout{5000};  // from TCP accept to the open WebSocket
};

// The address at which a side serves its status over HTTP.
struct StatusOptions {
  std::string address{};  // a literal; empty: only the socket in the runtime folder
  std::uint16_t port = 0;
  std::vector<std::string> groups{};  // groups that may read it, beyond the loopback; only with TLS
  bool beyond_loopback = false;
};

struct DialOptions {
  Url url;
  std::optional<HttpProxy> proxy;
  TlsOptions tls;
  std::chrono::milliseconds timeout{10000};  // from the name look-up to the open WebSocket
  bool slow = false;                         // no answer for a long time: attempts are rarer (Race)
};

}  // namespace connect_bridge
