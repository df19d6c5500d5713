// A server's place at a relay: who is connected to it there comes in as if by a listener. One unit:
// the control connection decides what becomes of its visitors.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "core/base/pace.hpp"
#include "core/base/random.hpp"
#include "core/link/dialer.hpp"
#include "core/ports/net_options.hpp"
#include "core/ports/ports.hpp"
#include "net/relay/place_at_relay.hpp"
#include "net/relay/relay_wire.hpp"
#include "net/tcp/proxy_header.hpp"
#include "net/tcp/traffic.hpp"
#include "net/tls/tls_files.hpp"
#include "net/tls/tls_lines.hpp"
#include "net/tls/way.hpp"

namespace connect_bridge {

class RouteWatch;

// Makes the ClientHello that a ticket is shown with.
class TicketHellos {
 public:
  TicketHellos();
  // Empty: OpenSSL cannot make it.
  [[nodiscard]] std::string make(const std::string& robot, const std::string& ticket) const;

 private:
  std::shared_ptr<SSL_CTX> context_;  // takes longer to make than all the rest
};

// Holds a control connection to the relay and makes it again whenever it is lost. For each visitor
// that the relay announces it dials the relay with the ticket (docs/protocol.md, "Relay"). The
// relay is trusted with the visitors' addresses and with nothing else: its requests are bounded.
// Thread: that of the io_context.
class RelayDoor : public std::enable_shared_from_this<RelayDoor> {
 public:
  struct Events {
    // A connection of which no byte was read yet, and for whom.
    std::function<void(TcpSocket, const Source&)> arrived;
    std::function<void(LogLevel, const std::string&)> log;
    // The pin of the key that this server shows to its clients; may be empty.
    std::function<std::string()> own_pin{};
  };

  RelayDoor(asio::io_context& io, RelayOptions options, SocketOptions sockets, Events events);
  ~RelayDoor();
  // Once. Empty, or what is wrong with the files.
  [[nodiscard]] std::string open();
  void close();  // no event follows
  // The path to the relay may have changed, as a connection by it has ended: whether the relay is
  // still there is asked at once, unless it is asked already.
  void look();
  [[nodiscard]] const PlaceAtRelay& place() const { return place_; }
  // The server's key may have changed: the relay has to know how to tell its clients from others.
  void tell_word();
  // Ends the wait after a refused login once the token is another one. Reads a file meanwhile.
  void check_token();
  // Bytes of the control connections, and of visitors that were not handed over.
  [[nodiscard]] Traffic traffic();

 private:
  // A visitor's connection on its way.
  struct Ticket {
    explicit Ticket(asio::io_context& io) : limit(io) {}
    std::string hello;
    Source source;
    std::shared_ptr<Way> way;
    std::unique_ptr<TcpSocket> socket;
    asio::steady_timer limit;
  };
  using TicketPtr = std::shared_ptr<Ticket>;

  void dial();
  void on_connected(std::optional<TcpSocket> socket, const Failure& why);
  void on_tls(const ErrorCode& error);
  void on_line(std::string_view line);
  void on_visitor(std::string_view words);
  void dial_with(const TicketPtr& ticket);
  // A copy: the one that the caller has may be in the set that it leaves.
  void forget(TicketPtr ticket);
  void ping();
  void on_routes_changed();
  // Since it was asked last. Most changes concern others: containers, addresses that are renewed.
  bool takes_another_route();
  // Whether the relay has kept its welcome for a while.
  [[nodiscard]] bool is_steady() const;
  void on_ended(const Failure& why);
  // Dials again, after a while.
  void fail(const Failure& why, DialFailure failure);
  void wait();
  void after(asio::steady_timer& timer, Duration time, void (RelayDoor::*then)());
  void on_silence();

  asio::io_context& io_;
  const RelayOptions options_;
  const SocketOptions sockets_;
  Events events_;
  TlsFiles tls_;
  std::shared_ptr<Way> way_;
  std::shared_ptr<TlsLines> lines_;
  std::shared_ptr<RouteWatch> routes_;
  asio::steady_timer limit_;  // until it is welcome, then for each answer
  asio::steady_timer next_;   // the next dial, or the next ping
  Dialer dialer_;
  Random random_;
  const std::string process_;               // tells it from another one with its token
  std::optional<asio::ip::address> tried_;  // the relay's, as it was dialed last
  std::string route_;                       // to it, as last seen; empty: not known
  std::string token_;                       // the last that was sent
  bool token_refused_ = false;
  TicketHellos hellos_;
  Pace visitors_;
  Pace lines_pace_{kRelayLinesAtOnce, kRelayLinePeriod};
  // A process that stood still reads many lines at once: so the first times are no fault.
  Pace leaves_{2, std::chrono::minutes(1)};
  Pace looks_{kRobotLinesAtOnce / 3, 2 * kRobotLinePeriod};
  bool welcome_ = false;
  TimePoint welcome_at_{};
  bool was_welcome_ = false;  // ever
  bool asked_ = false;        // a ping is without an answer
  bool takes_words_ = false;  // the relay there
  std::string word_;          // sent to the relay; it tells clients of this robot from others
  Traffic past_;              // of control connections that are closed
  std::string logged_;        // the last problem in the log
  PlaceAtRelay place_;
  std::set<TicketPtr> tickets_;
};

}  // namespace connect_bridge
