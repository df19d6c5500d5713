#include "run/bridge.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <chrono>
#include <cmath>
#include <csignal>
#include <utility>

#include "core/base/overloaded.hpp"
#include "net/tcp/steady_now.hpp"
#include "net/tcp/system_now.hpp"
#include "net/tls/certified.hpp"
#include "ops/audit/audit_json.hpp"
#include "ops/doctor/diagnostics.hpp"
#include "ops/doctor/status_diagnosis.hpp"
#include "ops/doctor/worth_telling.hpp"
#include "ops/status/status_json.hpp"
#include "run/exit_codes.hpp"
#include "version.hpp"

namespace connect_bridge {
namespace {

constexpr Duration kDiagnosesPeriod = std::chrono::seconds(5);
constexpr int kDiagnosisNice = 5;

constexpr char kNotRecorded[] = "the call cannot be recorded, and audit.required is set";

// The lag from which a line is logged: half a second, or less if links expire soon.
double lag_worth_a_line_ms(Duration dead_after) {
  return std::min(kLagMsWorthTelling, milliseconds_of(dead_after) / 3);
}

ros::GatewayOptions gateway_options(const BridgeParts& parts) {
  ros::GatewayOptions options;
  options.message_bytes_max = parts.side.reassembly.message_bytes_max;
  options.types_not_installed = parts.config.carries_types_not_installed;
  return options;
}

}  // namespace

Bridge::Bridge(ros::Node& node, BridgeParts parts)
    : node_(node),
      parts_(std::move(parts)),
      side_(parts_.side, parts_.side.secret_random(), system_now()),
      loop_(io_, side_,
            {[&node] { return node.ros_now(); },
             [this](Action&& action) { return carry_out(std::move(action)); },
             [this] { return network_.has_one_at_most(); },
             [this](ConnectionId id) { network_.read_on(id); }, [this] { send(); }}),
      gateway_(node, gateway_options(parts_),
               [this] { boost::asio::post(io_, [this] { on_wake(); }); }),
      parameters_(io_, node, std::move(parts_.config), std::move(parts_.folder),
                  {[this](const Config& now) { apply(now); },
                   [this](bool on) { gateway_.set_use_sim_time(on); },
                   [this](AuditEvent event, const std::string& what) { note(event, what); }}),
      network_(io_,
               {[this](Input&& input) { on_network(std::move(input)); },
                [this](ConnectionId id, const Repairs& repairs) {
                  return loop_.next_packet(id, repairs);
                },
                [this](PacketReceived&& packet) { loop_.arrived(std::move(packet)); },
                [this](Log&& log) { node_.log(log.level, log.text); }},
               parts_.sockets),
      status_file_([this](const std::string& problem) { log_later(LogLevel::kWarn, problem); }),
      lately_(steady_now()),
      supervisor_(io_, parts_.notify_socket),
      seconds_(io_),
      stop_(io_, [this] { stop(); }),
      hangup_(io_, [this] { parameters_.reload(); }),
      // Two threads: a job of seconds (a high level of zstd) does not delay jobs of milliseconds.
      workers_({.threads = 2}, [this](JobDone done) { feed_result(workers_, std::move(done)); }),
      // One picture after the other: libvpx's own threads would spin.
      picture_workers_({.threads = 1, .nice = 5, .cores = parts_.config.picture_cpu},
                       [this](JobDone done) { feed_result(picture_workers_, std::move(done)); }),
      login_desk_(
          {parts_.authenticator.get(), std::move(parts_.credential_file), parts_.side.login_timeout,
           ListenOptions::kLoopbackShare * parts_.listen.pending_per_address_max},
          {[this](Input&& input) { feed_later(std::move(input)); },
           [this](Log&& line) { log_later(line.level, std::move(line.text)); }}),
      status_site_({node.facts().full_name, parameters_.config().status, parameters_.config().tls,
                    parameters_.config().auth},
                   [this](LogLevel level, const std::string& text) { log_later(level, text); }),
      guard_(parts_.side.role == Role::kServer ? "server" : "client") {}

std::string Bridge::open() {
  if (const std::string refused = network_.refused_options(); !refused.empty())
    node_.log(LogLevel::kWarn, "this host refuses socket options: " + refused +
                                   "; the bridge runs, but urgent messages may be slower "
                                   "(TCP_NOTSENT_LOWAT, congestion_control)");
  if (const auto level = parameters_.config().log_level) node_.set_log_level(level);
  std::string problem = open_audit_log();
  if (problem.empty()) problem = status_site_.open();
  const bool server = parts_.side.role == Role::kServer;
  if (problem.empty()) problem = server ? listen() : network_.dial_problem(parts_.dial);
  if (problem.empty()) note(AuditEvent::kStarted);
  if (const std::string none = gateway_.open_diagnostics(); !none.empty())
    node_.log(LogLevel::kWarn, "nothing is published on /diagnostics: " + none);
  return problem;
}

std::string Bridge::open_audit_log() {
  const std::string& file = parameters_.config().audit.file;
  if (file.empty()) return {};
  if (std::string problem = AuditFile(file).open(); !problem.empty())
    return "audit.file: " + problem;
  audit_log_.emplace(file, [this](bool works, const std::string& problem) {
    log_later(works ? LogLevel::kInfo : LogLevel::kError,
              works ? "the audit log can be written again"
                    : "the audit log cannot be written, its lines wait: " + problem);
  });
  return {};
}

// Only keys that may change at run time differ from the previous configuration.
void Bridge::apply(const Config& now) {
  loop_.feed(PolicyChanged{now.policy});
  loop_.feed(LimitsChanged{now.limits.bytes_per_second_max, now.limits.outbox.bytes_per_second_max,
                           now.limits.resume_for, now.limits.resume_bytes_max});
  node_.set_log_level(now.log_level);
}

void Bridge::note(AuditEvent event, std::string reason) {
  if (!audit_log_) return;
  Audit line;
  line.event = event;
  line.node = node_.facts().full_name;
  line.reason = std::move(reason);
  audit_log_->add(std::move(line));
}

void Bridge::log_later(LogLevel level, std::string text) {
  boost::asio::post(io_, [this, level, text = std::move(text)] { node_.log(level, text); });
}

void Bridge::feed_later(Input&& input) {
  boost::asio::post(io_,
                    [this, input = std::move(input)]() mutable { loop_.feed(std::move(input)); });
}

std::string Bridge::listen() {
  std::string problem = network_.listen(parts_.listen);
  if (problem.empty()) {
    const std::string scheme = parts_.listen.tls ? "wss://" : "ws://";
    std::string urls;
    for (const std::string& address : network_.listen_addresses())
      urls += (urls.empty() ? "" : ", ") + scheme + address + "/" +
              (address.starts_with("[::]:") ? " (all addresses of this machine)" : "");
    node_.log(LogLevel::kInfo, "listening on " + urls);
  }
  return problem;
}

void Bridge::run() {
  guard_.watch();
  stop_.wait_for_signal();
  hangup_.wait_for_signal();
  tick_due_ = std::chrono::steady_clock::now();
  tick();
  loop_.feed(TimePassed{});
  io_.run();
  if (const std::string& file = parameters_.config().status_file; !file.empty())
    status_file_.write(file, std::make_shared<StatusPicture>(
                                 StatusPicture{side_.status(loop_.now()), run_status(0, false)}));
  if (const std::string problem = status_file_.end(); !problem.empty())
    node_.log(LogLevel::kWarn, problem);
}

void Bridge::feed_result(Workers& of, JobDone done) {
  boost::asio::post(io_, [this, &of, done = std::move(done)]() mutable {
    of.handled(done);
    loop_.feed(std::move(done));
  });
}

// Each action counts as a move of the loop. A middleware may wait a second for every entity that it
// destroys, so one step may take longer than the guard allows.
bool Bridge::carry_out(Action&& action) {
  guard_.moved();
  bool in_middleware = false;
  std::visit(Overloaded{
                 [&](Dial& a) { network_.dial(a.connection, parts_.dial); },
                 [&](OpenGate& a) { open_gate(a); },
                 [&](CloseConnection& a) { close_connection(a); },
                 [&](Authenticate& a) { authenticate(std::move(a)); },
                 [&](CompressJob& a) { workers_.add(std::move(a)); },
                 [&](DecompressJob& a) { workers_.add(std::move(a)); },
                 [&](EncodePicture& a) { picture_workers_.add(std::move(a)); },
                 [&](DecodePicture& a) { picture_workers_.add(std::move(a)); },
                 [&](EndPicture& a) { picture_workers_.end(a.picture); },
                 [&](CancelJob& a) {
                   workers_.cancel(a.job);
                   picture_workers_.cancel(a.job);
                 },
                 [&](SendRequest& a) {
                   in_middleware = true;
                   send_request(std::move(a));
                 },
                 [&](Log& a) { node_.log(a.level, a.text); },
                 [&](Audit& a) {
                   if (audit_log_) audit_log_->add(std::move(a));
                 },
                 [&](Stopped&) { network_.stop(); },
                 [&](const auto& a) {  // all other actions are for ROS
                   in_middleware = true;
                   gateway_.apply(a);
                 },
             },
             action);
  return in_middleware;
}

// Calls of a peer are recorded before they are sent.
void Bridge::send_request(SendRequest&& request) {
  if (request.line && audit_log_) {
    const bool required = parameters_.config().audit.required;
    if (!audit_log_->add(*std::move(request.line), required) && required)
      return loop_.feed(InvocationFailed{request.client, request.invocation, kNotRecorded});
  }
  gateway_.apply(request);
}

void Bridge::open_gate(const OpenGate& gate) {
  network_.allow(gate.connection, gate.packet_bytes_max);
  if (!parts_.joining) return;
  Joining joining = *std::exchange(parts_.joining, std::nullopt);
  const std::string problem = joining.keep();
  if (problem.empty()) {
    node_.log(LogLevel::kInfo, "paired: from now on this client starts without the invitation");
  } else {
    node_.log(LogLevel::kError, "paired, but this cannot be stored for the next start: " + problem);
  }
  loop_.feed(CredentialChanged{std::move(joining.token), "token"});
}

// Logins of closed connections take no time from other logins.
void Bridge::on_network(Input&& input) {
  if (const auto* const closed = std::get_if<ConnectionClosed>(&input)) {
    login_desk_.cancel(closed->connection);
    if (parts_.joining && ends_by(refused_invitation(*parts_.joining, closed->code))) return;
  }
  if (const auto* const failed = std::get_if<DialFailed>(&input))
    if (parts_.joining && failed->why.cause == Cause::kOtherKey && ends_by(failed->why.text))
      return;
  loop_.feed(std::move(input));
}

// The core would send the same code again, and each try counts at the server; a different server
// key needs a person. SIGTERM starts the one orderly way to stop.
bool Bridge::ends_by(const std::string& problem) {
  if (problem.empty()) return false;
  node_.log(LogLevel::kError, problem);
  exit_code_ = kExitConfiguration;
  std::raise(SIGTERM);
  return true;
}

// The network reports the end only after the peer's answer, which may take long.
void Bridge::close_connection(const CloseConnection& end) {
  login_desk_.cancel(end.connection);
  network_.close(end.connection, end.code, end.reason);
}

void Bridge::authenticate(Authenticate&& request) {
  if (parts_.certificate_login) return judge_certificate(request);
  login_desk_.ask(std::move(request));
}

// TLS has verified the certificate before the login.
void Bridge::judge_certificate(const Authenticate& request) {
  if (unread_files_.refuses_new() && !request.renewal) {
    loop_.feed(Authenticated{request.connection, std::nullopt, UnreadFiles::kReason, false});
    return;
  }
  Certified certified = network_.certified(request.connection);
  if (request.method != kCertificateLogin)
    certified = {std::nullopt, "login method '" + request.method + "' instead of 'certificate'"};
  loop_.feed(Authenticated{request.connection, std::move(certified.identity),
                           std::move(certified.reason)});
}

void Bridge::send() {
  while (const auto connection = side_.take_ready()) network_.send(*connection);
  if (stop_.has_begun() && network_.all_closed()) stop_.finish();
}

void Bridge::on_wake() {
  if (stop_.has_begun()) return;
  loop_.step([this](const auto& handle) { return gateway_.drain(handle); });
}

void Bridge::tick() {
  const auto now = std::chrono::steady_clock::now();
  every_second(milliseconds_of(std::max(Duration::zero(), Duration(now - tick_due_))));
  tick_due_ = std::max(tick_due_ + std::chrono::seconds(1), now);
  seconds_.expires_at(tick_due_);
  seconds_.async_wait([this](const boost::system::error_code& error) {
    if (!error && !stop_.has_begun()) tick();
  });
}

void Bridge::every_second(double lag_ms) {
  lag_ms = std::max(lag_ms, milliseconds_of(loop_.take_longest()));
  const auto times = lag_ms < lag_worth_a_line_ms(parts_.side.dead_after)
                         ? std::nullopt
                         : lags_.count(loop_.now());
  if (times)
    node_.log(LogLevel::kWarn, "this process was held up for " +
                                   std::to_string(std::lround(lag_ms)) +
                                   " ms and all links waited (busy machine, very large message)");
  const auto counters = gateway_.counters();
  heap_.every_second(counters.taken + counters.published + counters.graph_readings);
  network_.check_files();
  network_.every_second(loop_.now());
  if (parameters_.config().limits.bytes_per_second_max > 0)
    loop_.feed(TrafficCounted{network_.traffic().sent});
  parameters_.check_files();
  login_desk_.set_lacks_means(parameters_.lacks_means());
  if (parts_.certificate_login)
    if (const auto line = unread_files_.count(parameters_.lacks_means()))
      node_.log(line->level, line->text);
  lately_.on_second(lag_ms, lag_ms >= kLagMsWorthTelling, loop_.now().steady);
  take_status(lag_ms);
  supervisor_.every_second();
  guard_.moved();
}

RunStatus Bridge::run_status(double lag_ms, bool running) {
  RunStatus run;
  run.time = rfc3339(std::chrono::system_clock::now());
  run.running = running;
  run.started = rfc3339(started_);
  run.version = kProgramVersion;
  run.certificate_end = network_.certificate_end();
  run.node = node_.facts().full_name;
  run.role = parameters_.config().role;
  run.is_robot = parameters_.config().is_robot();
  run.prefix = parameters_.config().prefix;
  run.loop_lag_ms = lag_ms;
  run.ros = gateway_.counters();
  run.network = network_.counts();
  run.traffic = network_.traffic();
  run.listens = network_.listen_addresses();
  if (audit_log_) run.audit = audit_log_->counts();
  run.relays = network_.relays();
  run.refused_parameters = parameters_.refused_files();
  run.needs_restart = parameters_.needs_restart();
  run.refused_files = network_.refused_files();
  append(run.refused_files, login_desk_.refused_files());
  if (!parameters_.config().status_file.empty()) run.status_file_problem = status_file_.problem();
  return run;
}

void Bridge::take_status(double lag_ms) {
  const TimePoint now = loop_.now().steady;
  const bool is_diagnosed = now - diagnosed_at_ >= kDiagnosesPeriod;
  const bool wanted =
      status_site_.wanted() || gateway_.diagnostics_wanted() || is_diagnosed || lately_.is_due(now);
  if (taking_ || (parameters_.config().status_file.empty() && !wanted)) return;
  taking_ = Taking{
      std::make_shared<StatusPicture>(StatusPicture{side_.own_status(), run_status(lag_ms, true)}),
      side_.links(), is_diagnosed};
  if (is_diagnosed) diagnosed_at_ = now;
  std::reverse(taking_->left.begin(), taking_->left.end());
  lately_.add(taking_->picture->run, taking_->picture->side, now);
  take_status_of_next();
}

void Bridge::take_status_of_next() {
  auto& [picture, left, is_diagnosed] = *taking_;
  if (left.empty()) {
    link_places_.follow(picture->side.links);
    picture->places = link_places_;
    if (status_site_.wanted()) status_site_.publish(picture);
    if (gateway_.diagnostics_wanted()) publish_diagnostics(*picture);
    if (const std::string& file = parameters_.config().status_file; !file.empty())
      status_file_.write(file, picture);
    if (is_diagnosed) diagnose(picture);
    return taking_.reset();
  }
  if (auto link = side_.status_of(left.back(), loop_.now())) {
    const TcpCounts tcp = network_.tcp_counts(link->connection);
    link->segments = tcp.segments;
    link->retransmitted = tcp.repairs.repeated;
    lately_.add(*link, loop_.now().steady);
    picture->side.links.push_back(*std::move(link));
  }
  left.pop_back();
  boost::asio::post(io_, [this] { take_status_of_next(); });
}

void Bridge::publish_diagnostics(const StatusPicture& picture) {
  const auto all = diagnostics_of(picture, system_now());
  const Payload message = diagnostic_array(all, node_.facts().full_name, node_.ros_now());
  gateway_.publish_diagnostics(message.view());
}

// On a thread of its own: a diagnosis takes as long as the status is.
void Bridge::diagnose(std::shared_ptr<const StatusPicture> picture) {
  const auto& links = picture->side.links;
  const auto is_open = [](const LinkStatus& link) { return link.open; };
  if (diagnosing_ || std::none_of(links.begin(), links.end(), is_open)) return;
  diagnosing_ = true;
  boost::asio::post(diagnosis_, [this, picture = std::move(picture),
                                 facts = facts_of(parameters_.config())] {
    // Linux sets the priority of this thread alone.
    (void)::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kDiagnosisNice);
    try {
      const Json status = Json::parse(to_json(*picture), nullptr, false);
      // Each link is a step of its own: a check costs as much as the link has channels.
      for (auto& [link, findings] : findings_for_peers(status, facts))
        feed_later(FindingsMade{{{link, std::move(findings)}}});
    } catch (const std::exception& error) {  // no memory
      log_later(LogLevel::kWarn, std::string{"peers are not told of findings: "} + error.what());
    }
    boost::asio::post(io_, [this] { diagnosing_ = false; });
  });
}

void Bridge::stop() {
  node_.log(LogLevel::kInfo, "stopping");
  supervisor_.stopping();
  loop_.feed(StopRequested{});
  note(AuditEvent::kStopped);
}

}  // namespace connect_bridge
