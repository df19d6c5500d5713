// Two sides of the network layer on one io_context, and a raw TCP peer for protocol violations.
#pragma once

#include <arpa/inet.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cstring>
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "net/websocket/network.hpp"

namespace connect_bridge::test {

using namespace std::chrono_literals;

struct Loop {
  boost::asio::io_context io;

  bool until(const std::function<bool()>& reached, std::chrono::milliseconds limit = 5s) {
    const auto end = std::chrono::steady_clock::now() + limit;
    while (!reached()) {
      if (std::chrono::steady_clock::now() > end) return false;
      io.restart();
      io.run_one_for(5ms);
    }
    return true;
  }
  void run_for(std::chrono::milliseconds time) {
    io.restart();
    io.run_for(time);
  }
};

inline Bytes bytes_of(std::string_view text) {
  return {text.begin(), text.end()};
}
inline std::string text_of(const Payload& payload) {
  return {payload.view().begin(), payload.view().end()};
}

struct Closing {
  std::optional<std::uint16_t> code;
  std::string reason;
  Cause cause = Cause::kNone;  // without a code
};

// Stands for the program's loop: records inputs, hands out packets.
struct Side {
  explicit Side(Loop& loop, SocketOptions sockets = {})
      : network(loop.io,
                {[this](Input&& input) { on(std::move(input)); },
                 [this](ConnectionId id, const Repairs&) { return next(id); },
                 [this](PacketReceived&& packet) { take(std::move(packet)); },
                 [this](Log&& log) { logs.push_back(log.text); }},
                std::move(sockets)) {}

  void send(ConnectionId id, std::string_view bytes, bool text = false) {
    send(id, Packet{text, {Payload::adopt(bytes_of(bytes))}});
  }
  void send(ConnectionId id, Packet packet) {
    out[id].push_back(std::move(packet));
    network.send(id);
  }

  std::optional<Packet> next(ConnectionId id) {
    ++asked;
    auto& queue = out[id];
    if (queue.empty()) return std::nullopt;
    Packet packet = std::move(queue.front());
    queue.pop_front();
    return packet;
  }

  void on(Input&& input) {
    if (auto* opening = std::get_if<ConnectionOpened>(&input)) {
      opened.push_back(opening->connection);
      openings.push_back(*opening);
      peers[opening->connection] = opening->peer;
      if (packet_bytes_max > 0) network.allow(opening->connection, packet_bytes_max);
    } else if (auto* failed = std::get_if<DialFailed>(&input)) {
      failures[failed->connection] = failed->why.text;
      causes[failed->connection] = failed->why.cause;
      ++failure_count;
    } else if (auto* closing = std::get_if<ConnectionClosed>(&input)) {
      closed[closing->connection] = {closing->code, closing->reason, closing->cause};
      ++closed_count;
    }
  }

  void take(PacketReceived&& packet) {
    const ConnectionId id = packet.connection;
    received_bytes += packet.payload.size();
    if (echo) send(id, Packet{packet.text, {packet.payload}});
    received[id].push_back(std::move(packet));
    if (reads) network.read_on(id);
  }

  [[nodiscard]] std::size_t packets(ConnectionId id) { return received[id].size(); }
  [[nodiscard]] bool is_closed(ConnectionId id) const { return closed.count(id) != 0; }

  bool echo = false;
  bool reads = true;                       // on, behind each packet
  std::size_t packet_bytes_max = 1 << 20;  // 0: the gate stays shut
  std::map<ConnectionId, std::deque<Packet>> out;
  std::vector<ConnectionId> opened;
  std::vector<ConnectionOpened> openings;
  std::map<ConnectionId, std::string> peers;
  std::map<ConnectionId, std::string> failures;
  std::map<ConnectionId, Cause> causes;  // of these
  std::map<ConnectionId, std::vector<PacketReceived>> received;
  std::map<ConnectionId, Closing> closed;
  std::vector<std::string> logs;
  std::size_t asked = 0;  // for a packet
  std::size_t received_bytes = 0;
  std::size_t closed_count = 0;
  std::size_t failure_count = 0;
  Network network;
};

inline constexpr ConnectionId kDial{77};

// A server that listens on a free port of the loopback, a client that dials it.
struct Pair {
  explicit Pair(ListenOptions options = {}, SocketOptions sockets = {})
      : server(loop, sockets), client(loop, sockets) {
    options.port = 0;
    problem = server.network.listen(options);
  }

  [[nodiscard]] DialOptions dial_options(const std::string& scheme = "ws") const {
    DialOptions options;
    options.url = {scheme == "wss", "127.0.0.1", server.network.listen_port(), "/"};
    return options;
  }

  // True when both sides are open.
  bool connect(ConnectionId id = kDial) { return connect(dial_options(), id); }
  bool connect(const DialOptions& options, ConnectionId id = kDial) {
    const std::size_t before = server.opened.size();
    client.network.dial(id, options);
    loop.until([&] {
      return client.failures.count(id) != 0 ||
             (client.peers.count(id) != 0 && server.opened.size() > before);
    });
    return client.peers.count(id) != 0;
  }
  [[nodiscard]] ConnectionId accepted() const { return server.opened.back(); }

  Loop loop;
  std::string problem;
  Side server;
  Side client;
};

// Speaks TCP only.
class RawPeer {
 public:
  explicit RawPeer(std::uint16_t port, const char* host = "127.0.0.1")
      : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    ::inet_pton(AF_INET, host, &address.sin_addr);
    const int at_once = 1;
    ::setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &at_once, sizeof at_once);
    connected = ::connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
  }
  ~RawPeer() {
    if (socket_ >= 0) ::close(socket_);
  }
  RawPeer(const RawPeer&) = delete;
  RawPeer& operator=(const RawPeer&) = delete;

  void send(std::string_view bytes) {
    if (::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL) < 0) ended = true;
  }
  // Whether there was room for any of it.
  bool send_some(std::string_view bytes) {
    return ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT) > 0;
  }
  void half_close() { ::shutdown(socket_, SHUT_WR); }
  void reset() {
    const linger at_once{1, 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
    ::close(std::exchange(socket_, -1));
  }
  // Takes what is there; sets `ended` when the other side has closed.
  void poll() {
    char buffer[4096];
    for (;;) {
      const ssize_t n = ::recv(socket_, buffer, sizeof buffer, MSG_DONTWAIT);
      if (n > 0) {
        text.append(buffer, static_cast<std::size_t>(n));
        continue;
      }
      if (n == 0 || (errno != EAGAIN && errno != EWOULDBLOCK)) ended = true;
      return;
    }
  }
  [[nodiscard]] sockaddr_in address() const {
    sockaddr_in own{};
    socklen_t size = sizeof own;
    ::getsockname(socket_, reinterpret_cast<sockaddr*>(&own), &size);
    return own;
  }
  bool ends(Loop& loop, std::chrono::milliseconds limit = 5s) {
    return loop.until([&] { return poll(), ended; }, limit);
  }
  bool sees(Loop& loop, const std::string& what) {
    return loop.until([&] { return poll(), text.find(what) != std::string::npos; });
  }

  std::string text;
  bool ended = false;
  bool connected = false;

 private:
  int socket_;
};

inline std::string upgrade_request(const std::string& extra = "", const std::string& path = "/",
                                   const std::string& subprotocol = "ros2-connect.v1") {
  return "GET " + path +
         " HTTP/1.1\r\nHost: robot\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
         "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n" +
         (subprotocol.empty() ? "" : "Sec-WebSocket-Protocol: " + subprotocol + "\r\n") + extra +
         "\r\n";
}

}  // namespace connect_bridge::test
