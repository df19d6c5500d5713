// Joins visitors with robots that have no address of their own (docs/protocol.md, "Relay").
// One unit: robots, visitors and joined pairs share the limits of one process.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "core/base/address_paces.hpp"
#include "core/base/log_limit.hpp"
#include "core/base/pace.hpp"
#include "core/ports/net_options.hpp"
#include "core/ports/ports.hpp"
#include "net/relay/relay_wire.hpp"
#include "net/tcp/admission.hpp"
#include "net/tcp/proxy_header.hpp"
#include "net/tcp/tcp_doors.hpp"
#include "net/tls/tls_files.hpp"
#include "net/tls/tls_lines.hpp"
#include "relay/joint.hpp"
#include "relay/name_desk.hpp"
#include "relay/relay_arrival.hpp"
#include "relay/relay_status.hpp"
#include "relay/robot_names.hpp"
#include "relay/visitor_paces.hpp"

namespace connect_bridge {

struct RelaySetup {
  std::vector<std::string> addresses;  // as ListenOptions::addresses
  std::uint16_t port = 0;              // 0: any free one
  TlsOptions tls;                      // of the control connections
  RobotNames names;
  SocketOptions sockets;
  // The proxies whose connections begin with a PROXY protocol header, which has the caller's
  // address.
  AddressRanges proxies;
  // Control handshakes and visitors of one address, beyond: dropped, or refused.
  int address_calls_at_once = 30;
  Duration address_call_period = std::chrono::milliseconds(100);
  std::chrono::milliseconds twin_answer = kTwinAnswer;
  std::chrono::milliseconds known_twin_answer = kKnownTwinAnswer;
};

// Joins each visitor to the robot that it asks for. Of the bytes that it passes on it reads only
// the ClientHello, and it dials nowhere. Everything that strangers can use up here has a limit.
// Thread: that of the io_context.
class Relay : public std::enable_shared_from_this<Relay> {
 public:
  using Log = std::function<void(LogLevel, const std::string&)>;

  Relay(asio::io_context& io, RelaySetup setup, Log log);
  // Once. Empty, or what is wrong.
  [[nodiscard]] std::string open();
  // The port of the first address.
  [[nodiscard]] std::uint16_t port() const { return doors_->port(); }
  // Call it once a second: files that have changed are read again, whose token is no longer valid
  // has to go, and so have pairs of which an end is gone.
  void every_second();
  // Without times and version.
  [[nodiscard]] RelayStatus status() const;
  // Cuts everything at once.
  void close();

 private:
  // A connection that is in no pair: first its ClientHello is read, then it waits for its login or
  // for the robot.
  struct Caller {
    explicit Caller(TcpSocket socket)
        : arrival(std::move(socket)), limit(arrival.socket().get_executor()) {}
    RelayArrival arrival;
    asio::ip::tcp::endpoint from;
    asio::steady_timer limit;
    std::uint64_t number = 0;                   // those who came before have smaller ones
    std::shared_ptr<Admission::Pending> place;  // until it waits for a robot
    std::string network;                        // then: limits count by it
    std::string robot;
    std::string ticket;      // its hash; empty: no robot is asked to fetch it
    bool is_client = false;  // it knows the robot's word
    std::string call;        // what the robot is told of it
  };
  using CallerPtr = std::shared_ptr<Caller>;

  // A control connection, before its login or after it.
  struct Robot {
    explicit Robot(asio::io_context& io) : limit(io), answer(io) {}
    std::string name;
    std::string process;  // a word of its own; empty: it has said none
    std::string peer;
    TimePoint since{};  // its login
    std::shared_ptr<TlsLines> lines;
    Pace lines_pace{kRobotLinesAtOnce, kRobotLinePeriod};
    asio::steady_timer limit;
    std::shared_ptr<Admission::Pending> place;  // until its login
    std::string token;                          // empty: it has shown none
    bool asks_name = false;                     // by a code: the name is being given
    std::string clients_key;  // the hash of the word of its clients; empty: it has told none
    // Has the same token, and waits: whether this one answers a ping decides who stays.
    std::shared_ptr<Robot> twin;
    asio::steady_timer answer;
    std::optional<TimePoint> twin_refused;  // the last time, also in a connection before
  };
  using RobotPtr = std::shared_ptr<Robot>;

  // A handler that calls `then` with this, with `of` and with what it gets, if both are still
  // there.
  template <class Of, class Then>
  auto with(const std::shared_ptr<Of>& of, Then then) {
    return [weak = weak_from_this(), at = std::weak_ptr{of}, then](const auto&... got) {
      const auto self = weak.lock();
      const auto it = at.lock();
      if (self && it) std::invoke(then, *self, it, got...);
    };
  }

  void admit(TcpSocket socket);
  void on_arrived(const CallerPtr& caller, RelayArrival::State state);
  // Closes it, and forgets it wherever it is.
  void drop(const CallerPtr& caller);
  void drop(const CallerPtr& caller, RelayRefusal why);
  // The caller expects TLS, so that it gets a TLS alert before drop().
  void refuse(const CallerPtr& caller, RelayRefusal why);
  void count(RelayRefusal why) { ++refusals_[static_cast<std::size_t>(why)]; }

  void on_control(const CallerPtr& caller);
  void on_shaken(const RobotPtr& robot, const ErrorCode& error);
  void on_line(const RobotPtr& robot, std::string_view line);
  void on_login(const RobotPtr& robot, std::string_view words);
  void on_word(const RobotPtr& robot, std::string_view word);
  void refuse_login(const RobotPtr& robot);
  // The name was given, or cannot be.
  void on_given(const std::string& name, std::unique_ptr<Authenticator> robots,
                const std::string& problem);
  // Robots whose token is no longer valid have to go.
  void judge_all();
  void judge_some();
  // The token is right: it is the robot, unless another one with this token is here and answers.
  void enter(const RobotPtr& robot);
  void welcome(const RobotPtr& robot);
  // The robot has answered a ping, so there are two with its token. The one that was here stays,
  // and the other has to go.
  void on_twins(const RobotPtr& robot);
  void limit(const RobotPtr& robot, std::chrono::seconds time);
  // Forgets what has passed for a robot that is not here and has no pair.
  void forget_use(const std::string& name);
  // A copy: the one that the caller has may be in a table that it leaves.
  void end(RobotPtr robot, const std::string& why);

  void on_visitor(const CallerPtr& caller);
  // Somebody gives way if too many wait for this robot, or for all: the oldest of the network that
  // has most there.
  void make_room_at(const std::string& robot);
  void on_ticket(const CallerPtr& caller, const std::string& ticket);

  asio::io_context& io_;
  RelaySetup setup_;
  Log log_;
  TlsFiles tls_;
  NameDesk desk_;
  std::unordered_set<std::string> giving_;  // the names that the desk gives
  std::vector<std::string> to_judge_;       // robots
  std::shared_ptr<TcpDoors> doors_;
  Admission callers_;   // without a robot yet, by network
  AddressPaces paces_;  // of control handshakes and visitors, by address
  VisitorPaces visitor_paces_;
  Pace pace_;  // of control handshakes
  std::unordered_set<CallerPtr> calling_;
  std::unordered_set<RobotPtr> strangers_;  // without a login yet
  std::unordered_map<std::string, RobotPtr> robots_;
  std::unordered_set<std::shared_ptr<Joint>> joints_;
  std::unordered_map<std::string, RelayUse> uses_;  // by robot; none that is not here and unpaired
  RelayUse all_;
  std::uint64_t accepted_ = 0;
  std::array<std::uint64_t, kRelayRefusals> refusals_{};
  LogLimit refused_, not_given_, twins_;
  TimePoint judged_at_{};
};

}  // namespace connect_bridge
