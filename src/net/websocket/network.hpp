// WebSocket connections: listens, dials, moves packets. Decides nothing about their content.
// One unit: dials, arrivals and connections share their numbers, their traffic and their end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/ids.hpp"
#include "core/flow/outbox.hpp"
#include "core/ports/net_options.hpp"
#include "core/ports/ports.hpp"
#include "net/relay/place_at_relay.hpp"
#include "net/tcp/traffic.hpp"
#include "net/websocket/network_events.hpp"

namespace boost::asio {
class io_context;
}

namespace connect_bridge {

struct Certified;  // net/tls/certified.hpp

struct NetworkCounts : DoorCounts {
  std::size_t pending = 0;  // in a handshake now
  std::size_t open = 0;     // open WebSockets now
  // Pings and their like, frames without content, pieces of messages: beyond one frame a message.
  std::uint64_t extra_frames = 0;
  std::uint64_t held = 0;  // times that reading waited: a peer sent more than it may
};

// Order of events: one ConnectionOpened or DialFailed for each dial; after ConnectionOpened exactly
// one ConnectionClosed. The ids of accepted connections are given here, those of dials by the core.
//
// A new connection is behind a gate: packets of at most 4096 bytes, 16 KiB in total. allow() opens
// it.
//
// Thread: that of the io_context, which must outlive this object. Nothing throws.
class Network {
 public:
  Network(boost::asio::io_context& io, NetworkEvents events, SocketOptions sockets = {});
  // Closes all remaining connections at once and delivers nothing more.
  ~Network();
  Network(const Network&) = delete;
  Network& operator=(const Network&) = delete;

  // Starts to accept. Returns what is wrong (address in use, unreadable key, ...), empty if
  // nothing. Once only.
  [[nodiscard]] std::string listen(const ListenOptions& options);
  [[nodiscard]] std::uint16_t listen_port() const;
  // "127.0.0.1:9090", "[::1]:9090"
  [[nodiscard]] std::vector<std::string> listen_addresses() const;

  // Ends in ConnectionOpened or DialFailed.
  void dial(ConnectionId connection, const DialOptions& options);

  // Call once a second: certificates, keys and authorities whose files have changed are read again,
  // all together or not at all, for connections that begin from now on.
  void check_files();

  // Call once a second: the log hears now and then of strangers that were refused, and of a
  // certificate of ours that has ended or soon will; TCP is given what suits the path of each
  // connection.
  void every_second(const Now& now);
  // Why files of TLS that have changed are not used, each once; empty: they are.
  [[nodiscard]] std::vector<std::string> refused_files() const;
  // When the certificate that this side shows ends, or the first of those that are shown with it;
  // 0: never, or it shows none.
  [[nodiscard]] Stamp certificate_end() const;

  // There is one connection at most, handshakes at the listener included.
  [[nodiscard]] bool has_one_at_most() const;
  // The packet that has come there was handled: the next one may come.
  void read_on(ConnectionId connection);
  // There may be something to send on this connection; next_packet is asked for it, now or when
  // there is room again.
  void send(ConnectionId connection);

  // The peer has logged in (server) or welcomed us (client): it may send packets up to this size.
  void allow(ConnectionId connection, std::size_t packet_bytes_max);

  // Sends what was pulled, then a close frame (the reason is cut at 120 bytes). Nothing more is
  // read; ConnectionClosed (or, for a dial under way, DialFailed) follows within a second.
  void close(ConnectionId connection, CloseCode code, const std::string& reason);

  // Stops listening and closes everything with kGoingAway. Within a second the io_context has
  // nothing of ours left to do.
  void stop();
  // Whether ConnectionClosed was delivered for every connection.
  [[nodiscard]] bool all_closed() const;

  // The identity of an open connection's peer by its certificate.
  [[nodiscard]] Certified certified(ConnectionId connection) const;
  [[nodiscard]] NetworkCounts counts() const;
  // The problem of the files in these options, with which every dial would fail; empty: none.
  [[nodiscard]] std::string dial_problem(const DialOptions& options);
  // The socket options that this host refuses, in words; empty: none. Every connection goes without
  // them.
  [[nodiscard]] std::string refused_options() const;
  // The counts of TCP for an open connection; zeros: there is none.
  [[nodiscard]] TcpCounts tcp_counts(ConnectionId connection) const;
  // Server: its place at the relay, if it has one.
  [[nodiscard]] std::vector<PlaceAtRelay> relays() const;
  // The bytes of all connections since the start, also of those that became no WebSocket. A dial
  // counts when it ends, and only if TCP was connected.
  [[nodiscard]] Traffic traffic() const;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace connect_bridge
