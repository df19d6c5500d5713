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

// A server listens, a client dials.
enum class Role : std::uint8_t { kServer, kClient };

// TLS of a server or a client. Files are PEM. The first two are given together or not at all.
struct TlsOptions {
  std::string certificate_file{};  // the whole chain, our own certificate first
  std::string private_key_file{};
  // The authorities to trust. Empty: for a client the system's authorities; a server wants no
  // certificate of clients, else every client must show one.
  std::string ca_file{};
  // Client: SHA-256 of the public keys (SPKI) that the server may have, in base64; empty: any. With
  // pins and without `ca_file` the key alone decides: name, dates and authority are not checked.
  // Behind a pin may stand whom such a server is for rules: see Pin.
  std::vector<std::string> pins{};
  bool pins_by_invitation = false;  // they are those of a pairing: for messages
  // Why somebody else may change a file, for people, or empty: such a file is not used. Null: files
  // are not looked at.
  std::string (*distrusted)(const std::string& file) = nullptr;

  bool operator==(const TlsOptions&) const = default;
};

// Treatment of every TCP connection.
struct SocketOptions {
  // TCP_NOTSENT_LOWAT: the next packet is pulled only while fewer bytes than this wait unsent in
  // the kernel, so that urgent data overtakes at the last moment (docs/flow.md). 0: left to the
  // kernel, then every packet goes out at once.
  std::uint32_t unsent_bytes_max = 16384;
  // Bytes a client masks and sends in one go.
  std::uint32_t write_buffer_bytes = 128 << 10;
  // "bbr", "cubic", ...; "auto": what suits the path (CongestionChoice); empty or "host": the
  // host's
  std::string congestion_control;
  // Messages that are read from a connection per second; beyond it reading pauses, and the sender
  // has to wait. A burst of receive_burst passes at once.
  std::int64_t receive_packets_per_second = 50'000;
  std::chrono::milliseconds receive_burst{4000};
  std::chrono::milliseconds user_timeout{20000};  // unacknowledged data ends the connection
  std::chrono::seconds keepalive{15};             // first probe after this idle time; 0: off
};

// How a proxy gives the client's address. Only one way is used: a header that the proxy does not
// write itself may come from the client unchanged.
enum class ToldBy : std::uint8_t { kXForwardedFor, kProxyProtocol };

// A server that nobody can dial waits at a relay for those who want to get to it.
struct RelayOptions {
  Url url;                               // with the name of the robot that this server is there
  TlsOptions tls;                        // `ca_file` and `pins` of the relay
  std::function<std::string()> token{};  // read at each login; empty: there is none now
  std::string code{};                    // of the relay's line, for the first login; may be empty
  // Called at the first welcome there; what is wrong, or nothing. May be empty.
  std::function<std::string()> keep{};
};

struct ListenOptions {
  // Literals; "::" takes IPv6 and IPv4, "*" whatever there is.
  std::vector<std::string> addresses{"127.0.0.1"};
  std::uint16_t port = 9090;  // 0: any free one, see Network::listen_port()
  // Listening TCP sockets that this process was given, in place of `addresses` and `port`. They are
  // the listener's from now on.
  std::vector<int> sockets;
  std::optional<TlsOptions> tls;
  std::optional<RelayOptions> relay;  // needs `tls`
  // Addresses and ranges ("10.0.0.0/8") of proxies that are trusted to give the client's address:
  // the limits for an address then use that. With ToldBy::kProxyProtocol all their connections must
  // begin with such a header; connections of others must not.
  std::vector<std::string> trusted_proxies;
  ToldBy told_by = ToldBy::kXForwardedFor;
  bool proxies_only = false;         // others are dropped
  std::size_t connections_max = 64;  // beyond: HTTP 503
  // Addresses of the loopback may have so many times as much as others: a proxy there stands for
  // many clients.
  static constexpr int kLoopbackShare = 8;
  // Connections without a login, of all and of one address; beyond: the oldest is dropped.
  std::size_t pending_max = 320;
  std::size_t pending_per_address_max = 16;
  // TLS handshakes of one address, beyond: dropped; and of all, beyond: they wait for their turn.
  int address_handshakes_at_once = 30;
  Duration address_handshake_period = std::chrono::milliseconds(100);
  int handshakes_at_once = 150;
  Duration handshake_period = std::chrono::milliseconds(20);
  std::chrono::milliseconds handshake_timeout{5000};  // TCP accepted to WebSocket open
};

// Where the status of a side is asked for, by HTTP.
struct StatusOptions {
  std::string address{};  // a literal; empty: nowhere but at the socket in the runtime folder
  std::uint16_t port = 0;
  std::vector<std::string> groups{};  // who may look, beyond the loopback; there with TLS
  bool beyond_loopback = false;
};

struct DialOptions {
  Url url;
  std::optional<HttpProxy> proxy;
  TlsOptions tls;
  std::chrono::milliseconds timeout{10000};  // from the name look-up to the open WebSocket
  bool slow = false;  // nothing has answered for long: it is tried less often (Race)
};

}  // namespace connect_bridge
