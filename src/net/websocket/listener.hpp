// Accepts TCP connections, admits some, and hands over those that became WebSockets.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <unordered_set>

#include "core/base/address_paces.hpp"
#include "core/base/log_limit.hpp"
#include "core/base/pace.hpp"
#include "core/base/turns.hpp"
#include "core/ports/net_options.hpp"
#include "core/ports/ports.hpp"
#include "net/relay/relay_door.hpp"
#include "net/tcp/admission.hpp"
#include "net/tcp/proxy_header.hpp"
#include "net/tcp/tcp_doors.hpp"
#include "net/tcp/traffic.hpp"
#include "net/tls/tls_files.hpp"
#include "net/websocket/login_words.hpp"
#include "net/websocket/network_events.hpp"
#include "net/websocket/recent_logins.hpp"
#include "net/websocket/refusals.hpp"

namespace connect_bridge {

struct WebSocket;

class Listener : public std::enable_shared_from_this<Listener> {
 public:
  struct Arrival {
    std::shared_ptr<WebSocket> socket;
    ConnectionOpened from;  // without its number
    std::shared_ptr<Admission::Pending> pending_slot;
    std::shared_ptr<void> connection_slot;  // given back before that one, if it has had no login
  };
  struct Events {
    std::function<void(Arrival)> arrived;
    std::function<void(LogLevel, std::string)> log;
  };

  Listener(asio::io_context& io, SocketOptions sockets, Events events);
  ~Listener();

  // Empty, or what is wrong. Once only.
  [[nodiscard]] std::string open(const ListenOptions& options);
  // Accepts no more and drops handshakes; no event follows.
  void close();

  // Somebody has logged in from this address (ConnectionOpened), and may show this word next time.
  void note_login(const std::string& address, const std::string& word);
  // Reads certificates that have changed: for handshakes that begin from now on. Once a second.
  void check_files();
  [[nodiscard]] TlsFiles* tls_files() { return tls_ ? &*tls_ : nullptr; }  // null: no TLS
  // Once a second.
  void tell_refusals(TimePoint now) {
    if (const auto line = refusals_.take_line(now)) log(LogLevel::kInfo, *line);
  }

  // The port of the first address.
  [[nodiscard]] std::uint16_t port() const;
  // "127.0.0.1:9090", "[::1]:9090"
  [[nodiscard]] std::vector<std::string> addresses() const;
  [[nodiscard]] const DoorCounts& counts() const { return counts_; }
  [[nodiscard]] std::size_t pending() const { return visitors_.size(); }
  // Null: the listener has no place at a relay.
  [[nodiscard]] const PlaceAtRelay* relay() const { return relay_ ? &relay_->place() : nullptr; }
  // Bytes of connections that became no WebSocket, and of the place at a relay.
  [[nodiscard]] Traffic traffic() const;

 private:
  class Visitor;                                             // net/websocket/accept.hpp
  enum class By : std::uint8_t { kItself, kProxy, kRelay };  // kProxy: a trusted one
  using VisitorPtr = std::shared_ptr<Visitor>;

  // The pin of the key that clients see.
  [[nodiscard]] std::string own_pin() const;
  void on_arrived(TcpSocket socket);
  // By the relay, for whom it says.
  void on_relayed(TcpSocket socket, const Source& source);
  void admit(TcpSocket socket, const Source& source, By by);
  // The visitor's ClientHello has begun to come. Returns whether its handshake may begin.
  bool on_hello(Visitor& visitor);
  // In times of what an address may have of the places.
  [[nodiscard]] int share_of(const ConnectionOpened& from) const;
  // Whether it may begin a handshake; then it counts. False: its address has begun too many.
  bool take_handshake(const Visitor& visitor);
  // The visitor shows the word of a login.
  bool shows_word(const Visitor& visitor, TimePoint now);
  // The share of all connections by the relay, as a multiple of what one address may have.
  [[nodiscard]] int relayed_share() const;
  // The visitor's handshake begins, or waits for its turn among those of all.
  void line_up(const VisitorPtr& visitor);
  // Begins the handshakes whose turn it is.
  void begin_handshakes();
  void drop(TcpSocket& socket, const ConnectionOpened& from, const std::string& why);
  void note_refused(const ConnectionOpened& from, const std::string& why);
  // Whether it was here. No event of it follows.
  bool forget(const VisitorPtr& visitor);
  // Ends the connection without an answer, and frees its place.
  void abandon(const VisitorPtr& visitor);
  // A proxy has said for whom it connects, or nothing.
  void identify(Visitor& visitor, const std::optional<Source>& source);
  void on_open(const VisitorPtr& visitor);
  void on_refused(const VisitorPtr& visitor, const std::string& problem);
  void on_gave_way(Admission::Limit limit);
  void log(LogLevel level, std::string text);
  // A limit was reached: a line now and then.
  void log_limit(LogLimit& lines, const std::string& text);
  // A mistake of an operator, perhaps, but strangers can cause it too: a line now and then.
  void log_notice(const Visitor& visitor);

  asio::io_context& io_;
  SocketOptions sockets_;
  Events events_;
  std::shared_ptr<TcpDoors> doors_;
  std::shared_ptr<RelayDoor> relay_;  // null: none is configured
  ListenOptions options_;
  AddressRanges proxies_;
  std::optional<Admission> admission_;
  std::optional<Admission> relayed_;  // those of them who come by the relay, by address
  std::optional<TlsFiles> tls_;
  std::unordered_set<VisitorPtr> visitors_;
  // The paces of handshakes. A customer may have many addresses.
  struct HandshakePaces {
    AddressPaces address, customer;
  };
  std::optional<HandshakePaces> paces_, relayed_paces_;
  std::optional<AddressPaces> kept_paces_;  // beside these, of addresses with a login lately
  RecentLogins logins_;
  std::optional<AddressPaces> word_paces_;  // beside these, of who shows the word of a login
  LoginWords words_;
  Pace pace_{1, Duration::zero()};          // of all of them
  Pace relayed_pace_{1, Duration::zero()};  // of all who come by the relay
  Turns<std::string, VisitorPtr> line_;     // those who wait for it, by customer
  asio::steady_timer next_turn_;
  DoorCounts counts_;
  Traffic refused_traffic_;
  LogLimit dropped_, waited_, gave_way_, gave_way_of_address_;
  Pace notices_{1, std::chrono::minutes{10}};
  Refusals refusals_;
};

}  // namespace connect_bridge
