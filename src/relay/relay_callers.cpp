#include <array>
#include <boost/asio/read.hpp>
#include <utility>

#include "auth/secret.hpp"
#include "core/base/hex.hpp"
#include "net/relay_wire.hpp"
#include "net/socket_tuning.hpp"
#include "net/steady_now.hpp"
#include "relay/relay.hpp"

namespace connect_bridge {
namespace {

constexpr std::size_t kPairsOfRobot = 384;

// A fatal alert "unrecognized_name", before any handshake (RFC 8446 section 6).
constexpr std::array<unsigned char, 7> kNoSuchName{21, 3, 3, 0, 2, 2, 112};

// What waits is found by this: how long a look-up takes shows nothing of a ticket.
std::string key_of(std::string_view ticket) {
  return to_hex(sha256(view_of(ticket)));
}

}  // namespace

// ---- who comes

void Relay::admit(TcpSocket socket) {
  ErrorCode error;
  ++accepted_;
  const auto caller = std::make_shared<Caller>(std::move(socket));
  caller->from = caller->socket.remote_endpoint(error);
  if (error) return;  // gone already
  caller->from.address(plain_address(caller->from.address()));
  const bool is_proxy = contain(setup_.proxies, caller->from.address());
  caller->place = callers_.take_pending(is_proxy ? "" : network_of(caller->from.address(), 7),
                                        is_proxy ? 0 : 1);
  tune_socket(caller->socket.native_handle(), setup_.sockets);
  calling_.insert(caller);
  const auto let_go = [weak = weak_from_this(), of = std::weak_ptr{caller}](RelayRefusal why) {
    const auto self = weak.lock();
    const auto gone = of.lock();
    if (self && gone) self->drop(gone, why);
  };
  caller->place->give_way = [let_go] { let_go(RelayRefusal::kGaveWay); };
  caller->limit.expires_after(kHelloTime);
  caller->limit.async_wait([let_go](ErrorCode cancelled) {
    if (!cancelled) let_go(RelayRefusal::kTooLate);
  });
  is_proxy ? read_proxy(caller) : read_hello(caller);
}

void Relay::read_proxy(const CallerPtr& caller) {
  const ProxyHeader header = read_proxy_header(caller->proxy_header);
  if (header.state == ProxyHeader::State::kWrong) return drop(caller, RelayRefusal::kNoClientHello);
  if (header.state == ProxyHeader::State::kMore)
    return read_more(caller, caller->proxy_header, header.missing, &Relay::read_proxy);
  if (header.source) {  // else it looks whether this relay is here
    caller->from = {plain_address(header.source->address), header.source->port};
    callers_.move_pending(*caller->place, network_of(caller->from.address(), 7), 1);
  }
  read_hello(caller);
}

void Relay::read_hello(const CallerPtr& caller) {
  const ClientHello hello = read_client_hello(caller->hello);
  if (hello.state == ClientHello::State::kWrong) return drop(caller, RelayRefusal::kNoClientHello);
  if (hello.state == ClientHello::State::kComplete) return on_hello(caller, hello);
  read_more(caller, caller->hello, hello.missing, &Relay::read_hello);
}

void Relay::read_more(const CallerPtr& caller, Bytes& bytes, std::size_t missing,
                      void (Relay::*then)(const CallerPtr&)) {
  const std::size_t have = bytes.size();
  bytes.resize(have + missing);
  asio::async_read(caller->socket, asio::buffer(bytes.data() + have, missing),
                   [weak = weak_from_this(), caller, have, then](ErrorCode error, std::size_t n) {
                     const auto self = weak.lock();
                     if (!self || self->calling_.count(caller) == 0) return;
                     if (error && have + n == 0) return self->drop(caller);  // looks who is here
                     if (error) return self->drop(caller, RelayRefusal::kNoClientHello);
                     (self.get()->*then)(caller);
                   });
}

void Relay::on_hello(const CallerPtr& caller, const ClientHello& hello) {
  const std::vector<std::string>& offers = hello.protocols;
  const std::string first = offers.empty() ? "" : offers.front();
  caller->robot = hello.server_name;
  if (first == kRelayProtocol) return on_control(caller);
  if (first == kTicketProtocol) return on_ticket(caller, offers.size() == 2 ? offers[1] : "");
  on_visitor(caller);
}

void Relay::drop(const CallerPtr& caller) {
  calling_.erase(caller);
  waiting_.erase(caller->ticket);
  caller->limit.cancel();
  caller->place.reset();
  caller->place_at_robot.reset();
  ErrorCode ignored;
  caller->socket.close(ignored);
}

// The few bytes fit into an empty socket; whether they arrive does not matter.
void Relay::refuse(const CallerPtr& caller, RelayRefusal why) {
  ErrorCode ignored;
  caller->socket.non_blocking(true, ignored);
  caller->socket.write_some(asio::buffer(kNoSuchName), ignored);
  caller->socket.shutdown(TcpSocket::shutdown_send, ignored);
  drop(caller, why);
}

void Relay::drop(const CallerPtr& caller, RelayRefusal why) {
  count(why);
  drop(caller);
}

void Relay::count(RelayRefusal why) {
  ++refusals_[static_cast<std::size_t>(why)];
}

// ---- visitors

void Relay::on_visitor(const CallerPtr& caller) {
  const auto found = robots_.find(caller->robot);
  if (found == robots_.end()) return refuse(caller, RelayRefusal::kNoSuchRobot);
  if (uses_[caller->robot].pairs >= kPairsOfRobot) return refuse(caller, RelayRefusal::kRobotFull);
  const TimePoint now = steady_now();
  if (!paces_.take(network_of(caller->from.address(), 7), 1, now))
    return refuse(caller, RelayRefusal::kVisitorsOfSource);
  const std::string ticket = random_token();
  if (ticket.empty() || !robot_paces_.take(caller->robot, 1, now))  // mutant: visitors_of_robot
    return refuse(caller, RelayRefusal::kVisitorsOfRobot);
  caller->place_at_robot = visitors_.take_pending(caller->robot);
  caller->place_at_robot->give_way = caller->place->give_way;
  caller->ticket = key_of(ticket);
  waiting_[caller->ticket] = caller;
  caller->limit.expires_after(kTicketTime);
  caller->limit.async_wait(
      [weak = weak_from_this(), of = std::weak_ptr{caller}](ErrorCode cancelled) {
        const auto self = weak.lock();
        const auto waits = of.lock();
        if (self && waits && !cancelled) self->refuse(waits, RelayRefusal::kRobotSilent);
      });
  caller->call = "visitor " + ticket + ' ' + caller->from.address().to_string() + ' ' +
                 std::to_string(caller->from.port());
  const RobotPtr robot = found->second;
  robot->lines->say(caller->call);
}

void Relay::on_ticket(const CallerPtr& caller, const std::string& ticket) {
  const auto found = waiting_.find(key_of(ticket));
  const auto visitor = found == waiting_.end() ? nullptr : found->second.lock();
  if (!visitor) return drop(caller, RelayRefusal::kWrongTicket);
  const auto weak = weak_from_this();
  const std::string robot = visitor->robot;
  const auto joint =
      std::make_shared<Joint>(std::move(visitor->socket), std::move(caller->socket),
                              [weak, robot](bool to_robot, std::size_t bytes) {
                                const auto self = weak.lock();
                                if (!self) return;
                                for (RelayUse* const use : {&self->uses_[robot], &self->all_})
                                  (to_robot ? use->to_robot : use->to_visitors) += bytes;
                              });
  Bytes hello = std::move(visitor->hello);
  drop(visitor);  // the ticket is used
  drop(caller);
  joints_.insert(joint);
  for (RelayUse* const use : {&uses_[robot], &all_}) {
    ++use->pairs;
    ++use->visitors;
  }
  joint->start(std::move(hello), [weak, robot, at = std::weak_ptr{joint}] {
    const auto self = weak.lock();
    if (!self) return;
    for (RelayUse* const use : {&self->uses_[robot], &self->all_}) --use->pairs;
    self->forget_use(robot);
    self->joints_.erase(at.lock());
  });
}

}  // namespace connect_bridge
