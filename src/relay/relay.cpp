#include "relay/relay.hpp"

#include <openssl/ssl.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <utility>

#include "access/login/secret.hpp"
#include "access/login/token_table.hpp"
#include "core/base/hex.hpp"
#include "core/base/sha256.hpp"
#include "core/wire/text.hpp"
#include "net/relay/relay_wire.hpp"
#include "net/tcp/socket_tuning.hpp"
#include "net/tcp/steady_now.hpp"
#include "net/tcp/system_now.hpp"

namespace connect_bridge {
namespace {

constexpr std::size_t kCallersMax = 320;
constexpr std::size_t kCallersOfAddress = 16;
constexpr std::size_t kWaitingMax = 1024;  // for a robot, of all
constexpr std::size_t kWaitingOfRobot = 16;
constexpr std::size_t kPairsOfRobot = 384;
constexpr int kHandshakes = 300;
constexpr Duration kHandshakePeriod = std::chrono::milliseconds(2);
constexpr Duration kJudgePeriod = std::chrono::seconds(60);
constexpr std::size_t kJudgedAtOnce = 64;
constexpr std::chrono::seconds kGivingTime{10};           // as long as a robot waits
constexpr Duration kTwinShown = std::chrono::minutes(2);  // in the status

// A fatal alert "unrecognized_name", before any handshake (RFC 8446 section 6).
constexpr std::array<unsigned char, 7> kNoSuchName{21, 3, 3, 0, 2, 2, 112};

// Look-ups compare hashes, so that their time reveals nothing of a ticket.
std::string key_of(std::string_view ticket) {
  return to_hex(sha256(view_of(ticket)));
}

// Whoever offers anything else gets no answer to it.
int select_protocol(SSL*, const unsigned char** chosen, unsigned char* size,
                    const unsigned char* offered, unsigned offered_size, void*) {
  static const std::string ours = protocol_list({kRelayProtocol});
  unsigned char* found = nullptr;
  const ByteView list = view_of(ours);
  if (SSL_select_next_proto(&found, size, list.data(), static_cast<unsigned>(list.size()), offered,
                            offered_size) != OPENSSL_NPN_NEGOTIATED)
    return SSL_TLSEXT_ERR_ALERT_FATAL;
  *chosen = found;
  return SSL_TLSEXT_ERR_OK;
}

}  // namespace

Relay::Relay(asio::io_context& io, RelaySetup setup, Log log)
    : io_(io),
      setup_(std::move(setup)),
      log_(std::move(log)),
      tls_(setup_.tls, Role::kServer),
      desk_(io, setup_.names.hand_over()),
      callers_({0, kCallersMax, kCallersOfAddress, {}}),
      paces_(setup_.address_calls_at_once, setup_.address_call_period),
      pace_(kHandshakes, kHandshakePeriod) {}

std::string Relay::open() {
  std::string problem;
  if (!tls_.get(problem)) return problem;
  doors_ = std::make_shared<TcpDoors>(io_, TcpDoors::Events{if_alive(this, &Relay::admit), log_});
  problem = doors_->open(setup_.addresses, setup_.port);
  if (problem.empty()) doors_->accept();
  return problem;
}

void Relay::every_second() {
  for (const auto& joint : std::vector(joints_.begin(), joints_.end())) joint->look();
  if (const auto news = tls_.check())
    log_(news->used ? LogLevel::kInfo : LogLevel::kWarn, news->text);
  Now at;
  at.steady = steady_now();
  at.system = system_now();
  if (const auto line = tls_.certificate().take_line(at)) log_(LogLevel::kWarn, *line);
  // The name desk changes the file while it gives a name, and then reads it itself.
  const Refreshed refreshed = giving_.empty() ? setup_.names.refresh() : Refreshed{};
  for (const auto& text : refreshed.news) log_(LogLevel::kInfo, text);
  for (const auto& text : refreshed.warnings) log_(LogLevel::kWarn, text);
  for (const auto& text : refreshed.problems) log_(LogLevel::kWarn, text);
  const TimePoint now = steady_now();
  if (refreshed.changes.empty() && refreshed.news.empty() && now < judged_at_ + kJudgePeriod)
    return;
  judged_at_ = now;
  judge_all();
}

// All at once would take the loop a tenth of a second with 3,000 robots.
void Relay::judge_all() {
  const bool judges = !to_judge_.empty();
  to_judge_.clear();
  for (const auto& [name, robot] : robots_) to_judge_.push_back(name);
  if (!judges) judge_some();
}

void Relay::judge_some() {
  for (std::size_t i = 0; i < kJudgedAtOnce && !to_judge_.empty(); ++i) {
    const auto found = robots_.find(to_judge_.back());
    to_judge_.pop_back();
    if (found == robots_.end()) continue;
    const RobotPtr robot = found->second;
    if (!setup_.names.has(robot->name, robot->token, robot->peer))
      end(robot, "its token is no longer valid");
  }
  if (!to_judge_.empty()) asio::post(io_, if_alive(this, &Relay::judge_some));
}

void Relay::close() {
  if (doors_) doors_->close();
  for (const auto& caller : std::exchange(calling_, {})) drop(caller);
  for (const auto& robot : std::exchange(strangers_, {})) robot->lines->end();
  for (const auto& entry : std::exchange(robots_, {})) {
    entry.second->limit.cancel();
    entry.second->lines->end();
  }
  for (const auto& joint : std::exchange(joints_, {})) joint->cut();
}

// ---- who comes

void Relay::admit(TcpSocket socket) {
  ErrorCode error;
  ++accepted_;
  const auto caller = std::make_shared<Caller>(std::move(socket));
  caller->number = accepted_;
  caller->from = caller->arrival.socket().remote_endpoint(error);
  if (error) return;  // gone already
  caller->from.address(plain_address(caller->from.address()));
  const bool is_proxy = contain(setup_.proxies, caller->from.address());
  caller->place = callers_.take_pending(is_proxy ? "" : network_of(caller->from.address(), 7),
                                        is_proxy ? 0 : 1);
  tune_socket(caller->arrival.socket().native_handle(), setup_.sockets);
  calling_.insert(caller);
  caller->place->give_way =
      with(caller, [](Relay& self, const CallerPtr& it) { self.drop(it, RelayRefusal::kGaveWay); });
  call_after(caller->limit, kHelloTime, with(caller, [](Relay& self, const CallerPtr& it) {
               self.drop(it, RelayRefusal::kTooLate);
             }));
  const auto from = [](Relay& self, const CallerPtr& it, const Source& source) {
    if (!it->place) return;
    it->from = {plain_address(source.address), source.port};
    self.callers_.move_pending(*it->place, network_of(it->from.address(), 7), 1);
  };
  const auto read = [](Relay& self, const CallerPtr& it, RelayArrival::State state) {
    if (self.calling_.contains(it)) self.on_arrived(it, state);
  };
  caller->arrival.read(is_proxy, caller, {with(caller, from), with(caller, read)});
}

void Relay::on_arrived(const CallerPtr& caller, RelayArrival::State state) {
  if (state == RelayArrival::State::kNothing) return drop(caller);  // looks who is here
  if (state == RelayArrival::State::kWrong) return drop(caller, RelayRefusal::kNoClientHello);
  const ClientHello& hello = caller->arrival.hello();
  const std::vector<std::string>& offers = hello.protocols;
  const std::string first = offers.empty() ? "" : offers.front();
  caller->robot = hello.server_name;
  if (first == kRelayProtocol) return on_control(caller);
  if (first == kTicketProtocol) return on_ticket(caller, offers.size() == 2 ? offers[1] : "");
  on_visitor(caller);
}

void Relay::drop(const CallerPtr& caller) {
  calling_.erase(caller);
  caller->limit.cancel();
  caller->place.reset();
  ErrorCode ignored;
  caller->arrival.socket().close(ignored);
}

// The few bytes fit into an empty socket; whether they arrive does not matter.
void Relay::refuse(const CallerPtr& caller, RelayRefusal why) {
  ErrorCode ignored;
  caller->arrival.socket().non_blocking(true, ignored);
  caller->arrival.socket().write_some(asio::buffer(kNoSuchName), ignored);
  caller->arrival.socket().shutdown(TcpSocket::shutdown_send, ignored);
  drop(caller, why);
}

void Relay::drop(const CallerPtr& caller, RelayRefusal why) {
  count(why);
  drop(caller);
}

// ---- control connections

void Relay::on_control(const CallerPtr& caller) {
  const TimePoint now = steady_now();
  std::string problem;
  const TlsContext context = tls_.get(problem);
  const bool may = context && is_robot_name(caller->robot) &&
                   paces_.take(network_of(caller->from.address(), 7), 1, now) && pace_.take(now);
  if (!may) return drop(caller, RelayRefusal::kHandshakes);  // mutant: control_handshakes
  SSL_CTX_set_alpn_select_cb(context->native_handle(), &select_protocol, nullptr);
  const auto robot = std::make_shared<Robot>(io_);
  robot->name = caller->robot;
  robot->peer = host_and_port(caller->from.address().to_string(), caller->from.port());
  robot->place = std::move(caller->place);
  robot->place->silent = false;
  const std::vector<std::string>& offers = caller->arrival.hello().protocols;
  if (offers.size() == 2) robot->process = offers[1];
  robot->lines = std::make_shared<TlsLines>(std::move(caller->arrival.socket()), context);
  const Bytes hello = std::move(caller->arrival.bytes());
  drop(caller);
  strangers_.insert(robot);
  robot->place->give_way = with(robot, [](Relay& self, const RobotPtr& it) {
    self.count(RelayRefusal::kGaveWay);
    self.end(it, "gave way");
  });
  limit(robot, kHelloTime);
  robot->lines->shake_hands(true, hello, with(robot, &Relay::on_shaken));
}

void Relay::on_shaken(const RobotPtr& robot, const ErrorCode& error) {
  if (error) {
    count(RelayRefusal::kNoTls);
    return end(robot, "no TLS");
  }
  const auto ended = [](Relay& self, const RobotPtr& it, const Failure& why) {
    self.end(it, why.text);
  };
  robot->lines->open(kRelayLoginMax, {with(robot, &Relay::on_line), with(robot, ended)});
}

void Relay::on_line(const RobotPtr& robot, std::string_view line) {
  constexpr std::string_view kLogin = "login ", kClients = "clients ";
  if (strangers_.count(robot) == 0) {
    // An answer is no line of its own accord: else many copies would end the robot that is here.
    if (line == "pong" && robot->twin) return on_twins(robot);
    if (!robot->lines_pace.take(steady_now()))  // mutant: lines_of_a_robot
      return end(robot, "it sent more lines than allowed");
    if (line.starts_with(kClients)) return on_word(robot, line.substr(kClients.size()));
    if (line != "ping") return end(robot, "it sent a line that is not allowed");
    limit(robot, kRelaySilence);
    return robot->lines->say("pong");
  }
  if (!line.starts_with(kLogin) || !robot->token.empty())
    return end(robot, "it sent a line that is not allowed");
  on_login(robot, line.substr(kLogin.size()));
}

void Relay::on_word(const RobotPtr& robot, std::string_view word) {
  Digest digits{};
  if (!from_hex(word, digits)) return end(robot, "it sent a line that is not allowed");
  robot->clients_key = key_of(word);
}

void Relay::on_login(const RobotPtr& robot, std::string_view words) {
  const std::size_t space = words.find(' ');
  const std::string_view token = words.substr(0, space);
  const std::string_view code = space == std::string_view::npos ? "" : words.substr(space + 1);
  robot->token = token;
  if (setup_.names.has(robot->name, token, robot->peer)) return enter(robot);
  const auto taking = setup_.names.taking(robot->name, token, code, robot->peer);
  if (!taking) return refuse_login(robot);
  robot->asks_name = true;
  limit(robot, kGivingTime);
  // No more than there are codes.
  if (giving_.insert(robot->name).second)
    desk_.give(*taking, [weak = weak_from_this(), name = robot->name](
                            std::unique_ptr<Authenticator> robots, const std::string& wrong) {
      if (const auto self = weak.lock()) self->on_given(name, std::move(robots), wrong);
    });
}

void Relay::on_given(const std::string& name, std::unique_ptr<Authenticator> robots,
                     const std::string& problem) {
  giving_.erase(name);
  const bool given = robots != nullptr;
  if (given) {
    setup_.names.use(std::move(robots));
  } else if (const auto times = not_given_.count({steady_now(), 0})) {
    log_(LogLevel::kError, name + " cannot be given its name: " + problem + "; " +
                               std::to_string(*times) + " since the last line");
  }
  std::vector<RobotPtr> ask;
  for (const RobotPtr& robot : strangers_)
    if (robot->asks_name && robot->name == name) ask.push_back(robot);
  for (const RobotPtr& robot : ask) {
    if (!setup_.names.has(name, robot->token, robot->peer)) {
      refuse_login(robot);
      continue;
    }
    if (given) log_(LogLevel::kInfo, name + " is now registered to the robot at " + robot->peer);
    robot->asks_name = false;
    enter(robot);
  }
  if (giving_.empty()) judge_all();  // people may have changed the file, too
}

void Relay::refuse_login(const RobotPtr& robot) {
  count(RelayRefusal::kWrongLogin);
  if (const auto times = refused_.count({steady_now(), 0}))
    log_(LogLevel::kWarn, robot->peer + ": its token is not that of " + robot->name + "; " +
                              std::to_string(*times) + " since the last line");
  strangers_.erase(robot);
  robot->lines->say("refused");
  robot->lines->finish();
}

// The robot that is here may be dead without a word, as behind a NAT that has forgotten the
// connection. A copied disk makes two robots, and an operator must not drive one of them by chance.
void Relay::enter(const RobotPtr& robot) {
  robot->place.reset();
  const auto found = robots_.find(robot->name);
  if (found == robots_.end()) return welcome(robot);
  const RobotPtr here = found->second;
  if (!setup_.names.has(here->name, here->token, here->peer)) {
    end(here, "its token is no longer valid");  // its twin may be welcome now
    return enter(robot);
  }
  if (!robot->process.empty() && robot->process == here->process) {
    const RobotPtr other = std::exchange(here->twin, nullptr);
    robot->twin_refused = here->twin_refused;
    end(here, "it is connected again");
    welcome(robot);
    if (strangers_.contains(other)) enter(other);
    return;
  }
  limit(robot, kGivingTime);
  const RobotPtr before = std::exchange(here->twin, robot);
  if (before) return end(before, "it is connected again");  // a ping is on its way
  const auto time = here->twin_refused ? setup_.known_twin_answer : setup_.twin_answer;
  call_after(here->answer, time, with(here, [](Relay& self, const RobotPtr& it) {
               self.end(it, "it does not answer, and is connected again");
             }));
  here->lines->say("ping");
}

void Relay::on_twins(const RobotPtr& robot) {
  robot->answer.cancel();
  const RobotPtr other = std::exchange(robot->twin, nullptr);
  if (strangers_.erase(other) == 0) return;  // it has given up
  count(RelayRefusal::kTwin);
  robot->twin_refused = steady_now();
  if (const auto times = twins_.count({*robot->twin_refused, 0}))
    log_(LogLevel::kWarn,
         "two machines have the token of " + robot->name + " (a copied disk?): that at " +
             robot->peer + " stays, that at " + other->peer +
             " has to wait a minute. Give one of them a name, a token and keys of its own: end its "
             "pairing, then 'relay --robot' here and 'server --pair --via' there; " +
             std::to_string(*times) + " since the last line");
  other->lines->say("refused twin");
  other->lines->finish();
}

void Relay::welcome(const RobotPtr& robot) {
  strangers_.erase(robot);
  robots_[robot->name] = robot;
  static_cast<void>(uses_[robot->name]);
  robot->since = steady_now();
  robot->lines->limit_lines(kRobotLineMax);
  robot->lines->say("welcome clients");
  // The robot has not heard of these visitors if its former connection was dead.
  for (const CallerPtr& caller : calling_)
    if (!caller->ticket.empty() && caller->robot == robot->name) robot->lines->say(caller->call);
  limit(robot, kRelaySilence);
  log_(LogLevel::kInfo, robot->name + " is connected, from " + robot->peer);
}

void Relay::limit(const RobotPtr& robot, std::chrono::seconds time) {
  call_after(robot->limit, time, with(robot, [](Relay& self, const RobotPtr& it) {
               if (self.strangers_.contains(it)) self.count(RelayRefusal::kTooLate);
               self.end(it, "it sent nothing for too long");
             }));
}

void Relay::end(RobotPtr robot, const std::string& why) {
  robot->limit.cancel();
  robot->answer.cancel();
  robot->place.reset();
  robot->lines->end();
  strangers_.erase(robot);
  const auto found = robots_.find(robot->name);
  if (found == robots_.end() || found->second != robot) return;
  robots_.erase(found);
  forget_use(robot->name);
  log_(LogLevel::kInfo, robot->name + " is disconnected: " + to_text(why, why.size()));
  const RobotPtr next = std::exchange(robot->twin, nullptr);
  if (!strangers_.contains(next)) return;
  setup_.names.has(next->name, next->token, next->peer) ? welcome(next) : refuse_login(next);
}

// ---- visitors

void Relay::make_room_at(const std::string& robot) {
  std::vector<CallerPtr> all, of_robot;
  for (const CallerPtr& caller : calling_) {
    if (caller->ticket.empty()) continue;
    all.push_back(caller);
    if (caller->robot == robot) of_robot.push_back(caller);
  }
  const bool full = of_robot.size() >= kWaitingOfRobot;
  if (!full && all.size() < kWaitingMax) return;
  std::vector<CallerPtr>& among = full ? of_robot : all;
  // Visitors that have shown that they know their robot stay, if there are others.
  const auto others = std::partition(among.begin(), among.end(),
                                     [](const CallerPtr& caller) { return !caller->is_client; });
  if (others != among.begin()) among.erase(others, among.end());
  std::unordered_map<std::string_view, std::size_t> counts;
  for (const CallerPtr& caller : among) ++counts[caller->network];
  const CallerPtr last = *std::min_element(
      among.begin(), among.end(), [&](const CallerPtr& one, const CallerPtr& other) {
        const std::size_t more = counts[one->network], less = counts[other->network];
        return more != less ? more > less : one->number < other->number;
      });
  drop(last, RelayRefusal::kGaveWay);
}

void Relay::on_visitor(const CallerPtr& caller) {
  const auto found = robots_.find(caller->robot);
  if (found == robots_.end()) return refuse(caller, RelayRefusal::kNoSuchRobot);
  if (uses_[caller->robot].pairs >= kPairsOfRobot) return refuse(caller, RelayRefusal::kRobotFull);
  const TimePoint now = steady_now();
  caller->network = network_of(caller->from.address(), 7);
  if (!paces_.take(caller->network, 1, now)) return refuse(caller, RelayRefusal::kVisitorsOfSource);
  const RobotPtr robot = found->second;
  auto kind = VisitorPaces::Kind::kAny;
  if (!robot->clients_key.empty()) {
    const std::vector<std::string>& offers = caller->arrival.hello().protocols;
    const auto is_word = [&](const std::string& offer) {
      return key_of(offer) == robot->clients_key;
    };
    caller->is_client = !offers.empty() && offers.front() == kClientProtocol &&
                        offers.size() <= 1 + kClientWordsMax &&
                        std::any_of(offers.begin() + 1, offers.end(), is_word);
    kind = caller->is_client ? VisitorPaces::Kind::kClient : VisitorPaces::Kind::kOther;
  }
  const std::string ticket = random_token();
  if (ticket.empty() ||
      !visitor_paces_.take(robot->name, caller->network, kind, now))  // mutant: visitors_of_robot
    return refuse(caller, RelayRefusal::kVisitorsOfRobot);
  make_room_at(caller->robot);
  // A caller that waits for a robot takes no place of callers that have sent nothing.
  caller->place.reset();
  caller->ticket = key_of(ticket);
  call_after(caller->limit, kTicketTime, with(caller, [](Relay& self, const CallerPtr& it) {
               self.refuse(it, RelayRefusal::kRobotSilent);
             }));
  caller->call = "visitor " + ticket + ' ' + caller->from.address().to_string() + ' ' +
                 std::to_string(caller->from.port());
  robot->lines->say(caller->call);
}

void Relay::on_ticket(const CallerPtr& caller, const std::string& ticket) {
  const auto found =
      std::find_if(calling_.begin(), calling_.end(),
                   [key = key_of(ticket)](const CallerPtr& waits) { return waits->ticket == key; });
  if (found == calling_.end()) return drop(caller, RelayRefusal::kWrongTicket);
  const CallerPtr visitor = *found;
  const auto weak = weak_from_this();
  const std::string robot = visitor->robot;
  const auto joint = std::make_shared<Joint>(
      std::move(visitor->arrival.socket()), std::move(caller->arrival.socket()),
      [weak, robot](bool to_robot, std::size_t bytes) {
        const auto self = weak.lock();
        if (!self) return;
        for (RelayUse* const use : {&self->uses_[robot], &self->all_})
          (to_robot ? use->to_robot : use->to_visitors) += bytes;
      });
  Bytes hello = std::move(visitor->arrival.bytes());
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

// ---- status

void Relay::forget_use(const std::string& name) {
  const auto found = uses_.find(name);
  if (found != uses_.end() && found->second.pairs == 0 && !robots_.contains(name))
    uses_.erase(found);
}

RelayStatus Relay::status() const {
  RelayStatus status;
  const TimePoint now = steady_now();
  for (const auto& [name, use] : uses_) {
    const auto here = robots_.find(name);
    status.robots.push_back({name, "", {}, use, false});
    if (here == robots_.end()) continue;
    status.robots.back().peer = here->second->peer;
    status.robots.back().here_for = now - here->second->since;
    const auto& refused = here->second->twin_refused;
    status.robots.back().twin = refused && now < *refused + kTwinShown;
  }
  std::sort(status.robots.begin(), status.robots.end(),
            [](const auto& a, const auto& b) { return a.name < b.name; });
  status.waiting = calling_.size() + strangers_.size();
  status.accepted = accepted_;
  status.all = all_;
  status.refused = refusals_;
  if (const Stamp end = tls_.certificate().end(); end != 0)
    status.certificate_valid_until = date_text(end);
  return status;
}

}  // namespace connect_bridge
