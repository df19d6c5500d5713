#include "relay/relay.hpp"

#include <openssl/ssl.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "auth/secret.hpp"
#include "core/base/sha256.hpp"
#include "core/wire/text.hpp"
#include "net/listen_at.hpp"
#include "net/relay_wire.hpp"
#include "net/steady_now.hpp"

namespace connect_bridge {
namespace {

constexpr std::size_t kCallersMax = 320;
constexpr std::size_t kCallersOfAddress = 16;
constexpr std::size_t kVisitorsOfRobot = 16;
constexpr int kHandshakes = 300;
constexpr Duration kHandshakePeriod = std::chrono::milliseconds(2);
constexpr std::chrono::milliseconds kAcceptRetry{100};
constexpr Duration kJudgePeriod = std::chrono::seconds(60);

Stamp wall_now() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

bool is_line(const Identity& identity) {
  const auto& groups = identity.groups;
  return std::find(groups.begin(), groups.end(), kLineGroup) != groups.end();
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
      callers_({0, kCallersMax, kCallersOfAddress, {}}),
      visitors_({0, kCallersMax, kVisitorsOfRobot, {}}),
      paces_(setup_.address_calls_at_once, setup_.address_call_period),
      robot_paces_(kVisitorsAtOnce, kVisitorPeriod),
      pace_(kHandshakes, kHandshakePeriod) {}

std::string Relay::open() {
  std::string problem;
  if (!tls_.get(problem)) return problem;
  std::vector<std::string> addresses = setup_.addresses;
  if (addresses == std::vector<std::string>{"*"})
    addresses = {bind("::", setup_.port).empty() ? "" : "0.0.0.0"};  // a host without IPv6
  std::erase(addresses, "");
  for (const std::string& address : addresses)
    if (problem.empty()) problem = bind(address, doors_.empty() ? setup_.port : port());
  for (const auto& door : doors_)
    if (problem.empty()) accept(door);
  return problem;
}

std::string Relay::bind(const std::string& address, std::uint16_t port) {
  const auto door = std::make_shared<Door>(io_);
  const ListenResult result = listen_at(door->acceptor, address, port);
  if (!result.warning.empty()) log_(LogLevel::kWarn, result.warning);
  if (result.problem.empty()) doors_.push_back(door);
  return result.problem;
}

std::uint16_t Relay::port() const {
  ErrorCode ignored;
  return doors_.empty() ? std::uint16_t{0} : doors_[0]->acceptor.local_endpoint(ignored).port();
}

void Relay::accept(const std::shared_ptr<Door>& door) {
  door->acceptor.async_accept(
      io_.get_executor(), [weak = weak_from_this(), door](ErrorCode error, TcpSocket socket) {
        const auto self = weak.lock();
        if (!self || !door->acceptor.is_open()) return;
        if (!error) self->admit(std::move(socket));
        if (!error || error == asio::error::connection_aborted) return self->accept(door);
        if (self->no_room_.count({steady_now(), 0}))
          self->log_(LogLevel::kWarn, "cannot accept connections now: " + error.message());
        door->retry.expires_after(kAcceptRetry);
        door->retry.async_wait([weak, door](ErrorCode cancelled) {
          const auto again = weak.lock();
          if (again && !cancelled) again->accept(door);
        });
      });
}

void Relay::every_second() {
  for (const auto& joint : std::vector(joints_.begin(), joints_.end())) joint->look();
  if (const auto news = tls_.check())
    log_(news->used ? LogLevel::kInfo : LogLevel::kWarn, news->text);
  const Refreshed refreshed = setup_.robots->refresh(wall_now());
  for (const auto& text : refreshed.news) log_(LogLevel::kInfo, text);
  for (const auto& text : refreshed.warnings) log_(LogLevel::kWarn, text);
  for (const auto& text : refreshed.problems) log_(LogLevel::kWarn, text);
  const TimePoint now = steady_now();
  if (refreshed.changes.empty() && refreshed.news.empty() && now < judged_at_ + kJudgePeriod)
    return;
  judged_at_ = now;
  std::vector<RobotPtr> gone;
  for (const auto& [name, robot] : robots_)
    if (!is_its_name(*robot, robot->credential)) gone.push_back(robot);
  for (const RobotPtr& robot : gone) end(robot, "its token is no longer valid");
}

void Relay::close() {
  for (const auto& door : doors_) {
    ErrorCode ignored;
    door->acceptor.close(ignored);
    door->retry.cancel();
  }
  for (const auto& caller : std::exchange(calling_, {})) drop(caller);
  for (const auto& robot : std::exchange(strangers_, {})) robot->lines->end();
  for (const auto& entry : std::exchange(robots_, {})) {
    entry.second->limit.cancel();
    entry.second->lines->end();
  }
  for (const auto& joint : std::exchange(joints_, {})) joint->cut();
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
  robot->lines = std::make_shared<TlsLines>(std::move(caller->socket), context);
  const Bytes hello = std::move(caller->hello);
  drop(caller);
  strangers_.insert(robot);
  const auto weak = weak_from_this();
  const std::weak_ptr<Robot> of = robot;
  robot->place->give_way = [weak, of] {
    const auto self = weak.lock();
    const auto gone = of.lock();
    if (!self || !gone) return;
    self->count(RelayRefusal::kGaveWay);
    self->end(gone, "gave way");
  };
  limit(robot, kHelloTime);
  robot->lines->shake_hands(true, hello, [weak, of](ErrorCode error) {
    const auto self = weak.lock();
    const auto shaken = of.lock();
    if (self && shaken) self->on_shaken(shaken, error);
  });
}

void Relay::on_shaken(const RobotPtr& robot, const ErrorCode& error) {
  if (error) {
    count(RelayRefusal::kNoTls);
    return end(robot, "no TLS");
  }
  const auto weak = weak_from_this();
  const std::weak_ptr<Robot> of = robot;
  const auto on_its_end = [weak, of](const std::string& why) {
    const auto self = weak.lock();
    const auto gone = of.lock();
    if (self && gone) self->end(gone, why);
  };
  robot->lines->open(kRelayLoginMax, {[weak, of](std::string_view line) {
                                        const auto self = weak.lock();
                                        const auto known = of.lock();
                                        if (self && known) self->on_line(known, line);
                                      },
                                      on_its_end});
}

void Relay::on_line(const RobotPtr& robot, std::string_view line) {
  constexpr std::string_view kLogin = "login ";
  if (strangers_.count(robot) == 0) {
    if (line != "ping") return end(robot, "it says what it must not");
    limit(robot, kRelaySilence);
    return robot->lines->say("pong");
  }
  if (!line.starts_with(kLogin)) return end(robot, "it says what it must not");
  on_login(robot, line.substr(kLogin.size()));
}

bool Relay::is_its_name(const Robot& robot, const Bytes& credential) {
  const Judgement judgement = setup_.robots->judge({"token", credential, robot.peer}, wall_now());
  const bool may = judgement.identity && !is_line(*judgement.identity);  // mutant: line_as_login
  return may && judgement.identity->name == robot.name;                  // mutant: name_of_another
}

bool Relay::takes_name(const Robot& robot, std::string_view token, std::string_view code) {
  const Bytes shown(code.begin(), code.end());
  const Judgement judged = setup_.robots->judge({"token", shown, robot.peer}, wall_now());
  if (!judged.identity || judged.identity->name != robot.name || !is_line(*judged.identity) ||
      !token_problem(token).empty() || !setup_.hand_over)
    return false;
  std::string problem;
  auto robots = setup_.hand_over(robot.name, sha256(view_of(token)), problem);
  if (!robots) {
    log_(LogLevel::kError, robot.name + " cannot be given its name: " + problem);
    return false;
  }
  setup_.robots = std::move(robots);
  judged_at_ = {};  // who had the name before has to go
  log_(LogLevel::kInfo, robot.name + " belongs to who has used its line, from " + robot.peer);
  return true;
}

void Relay::on_login(const RobotPtr& robot, std::string_view words) {
  const std::size_t space = words.find(' ');
  const std::string_view token = words.substr(0, space);
  const std::string_view code = space == std::string_view::npos ? "" : words.substr(space + 1);
  Bytes credential(token.begin(), token.end());
  if (!is_its_name(*robot, credential) && (code.empty() || !takes_name(*robot, token, code))) {
    count(RelayRefusal::kWrongLogin);
    if (const auto times = refused_.count({steady_now(), 0}))
      log_(LogLevel::kWarn, robot->peer + ": its token is not that of " + robot->name + "; " +
                                std::to_string(*times) + " since the last line");
    strangers_.erase(robot);
    robot->lines->say("refused");
    return robot->lines->finish();
  }
  strangers_.erase(robot);
  robot->place.reset();
  robot->credential = std::move(credential);
  if (const auto before = robots_.find(robot->name); before != robots_.end())
    end(before->second, "it is connected again");
  robots_[robot->name] = robot;
  static_cast<void>(uses_[robot->name]);
  robot->since = steady_now();
  robot->lines->limit_lines(kRobotLineMax);
  robot->lines->say("welcome");
  // It has not heard of them if its connection was dead.
  for (const auto& entry : waiting_)
    if (const auto waits = entry.second.lock(); waits && waits->robot == robot->name)
      robot->lines->say(waits->call);
  limit(robot, kRelaySilence);
  log_(LogLevel::kInfo, robot->name + " is here, from " + robot->peer);
}

void Relay::limit(const RobotPtr& robot, std::chrono::seconds time) {
  robot->limit.expires_after(time);
  robot->limit.async_wait(
      [weak = weak_from_this(), of = std::weak_ptr{robot}](ErrorCode cancelled) {
        const auto self = weak.lock();
        const auto silent = of.lock();
        if (!self || !silent || cancelled) return;
        if (self->strangers_.contains(silent)) self->count(RelayRefusal::kTooLate);
        self->end(silent, "it is silent");
      });
}

void Relay::end(RobotPtr robot, const std::string& why) {
  robot->limit.cancel();
  robot->place.reset();
  robot->lines->end();
  strangers_.erase(robot);
  const auto found = robots_.find(robot->name);
  if (found == robots_.end() || found->second != robot) return;
  robots_.erase(found);
  forget_use(robot->name);
  log_(LogLevel::kInfo, robot->name + " is gone: " + to_text(why, why.size()));
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
    status.robots.push_back({name, "", {}, use});
    if (here == robots_.end()) continue;
    status.robots.back().peer = here->second->peer;
    status.robots.back().here_for = now - here->second->since;
  }
  std::sort(status.robots.begin(), status.robots.end(),
            [](const auto& a, const auto& b) { return a.name < b.name; });
  status.waiting = calling_.size() + strangers_.size();
  status.accepted = accepted_;
  status.all = all_;
  status.refused = refusals_;
  return status;
}

}  // namespace connect_bridge
