#include "run/bridge.hpp"

#include <malloc.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <csignal>
#include <ctime>
#include <random>

#include "config/describe.hpp"
#include "core/base/overloaded.hpp"
#include "run/status_json.hpp"

namespace connect_bridge {
namespace {

constexpr auto kStopTime = std::chrono::milliseconds(800);
constexpr unsigned kQuietSeconds = 5;

Stamp read_clock(clockid_t id) {
  timespec t{};
  clock_gettime(id, &t);
  return t.tv_sec * 1'000'000'000LL + t.tv_nsec;
}

std::uint64_t random_word() {
  std::random_device device;
  return (std::uint64_t{device()} << 32) | device();
}

ros::GatewayOptions gateway_options(const SideOptions& side) {
  ros::GatewayOptions options;
  options.message_bytes_max = side.reassembly.message_bytes_max;
  return options;
}

}  // namespace

Bridge::Bridge(ros::Node& node, BridgeParts parts)
    : signals_(io_, SIGINT, SIGTERM),
      timer_(io_),
      second_(io_),
      last_call_(io_),
      node_(node),
      parts_(std::move(parts)),
      config_(parts_.config),
      side_(parts_.side, random_word()),
      gateway_(node, gateway_options(parts_.side),
               [this] { boost::asio::post(io_, [this] { on_wake(); }); }),
      parameters_(node, parameter_options()),
      network_(io_,
               {[this](Input&& input) { feed(std::move(input)); },
                [this](ConnectionId id) { return side_.next_packet(id, now()); },
                [this](Log&& log) { node_.log(log.level, log.text); }},
               parts_.sockets) {
  workers_ = std::make_unique<Workers>(1, [this](JobDone done) {
    boost::asio::post(io_, [this, done = std::move(done)]() mutable {
      workers_->handled(done);
      feed(std::move(done));
    });
  });
}

Bridge::~Bridge() {
  workers_.reset();
}

std::string Bridge::open() {
  if (parts_.side.role == Role::kClient) return {};
  std::string problem = network_.listen(parts_.listen);
  if (problem.empty()) {
    const std::string scheme = parts_.listen.tls ? "wss://" : "ws://";
    node_.log(LogLevel::kInfo, "listening on " + scheme + parts_.listen.address + ":" +
                                   std::to_string(network_.listen_port()) + parts_.listen.path);
  }
  return problem;
}

void Bridge::run() {
  wait_for_signal();
  second_due_ = now().steady;
  every_second();
  feed(TimePassed{});
  io_.run();
}

void Bridge::wait_for_signal() {
  signals_.async_wait([this](const boost::system::error_code& error, int) {
    if (error) return;
    if (stopping_) return io_.stop();  // asked twice: at once
    stop();
    wait_for_signal();
  });
}

Now Bridge::now() const {
  return {TimePoint(Duration(read_clock(CLOCK_MONOTONIC))), read_clock(CLOCK_REALTIME),
          node_.ros_now()};
}

// An input may come from inside an action (a login answered at once): it waits for its turn.
void Bridge::feed(Input&& input) {
  inputs_.push_back(std::move(input));
  if (!settling_) settle();
}

void Bridge::settle() {
  settling_ = true;
  while (!inputs_.empty()) {
    Input input = std::move(inputs_.front());
    inputs_.pop_front();
    if (const auto* opened = std::get_if<ConnectionOpened>(&input))
      connections_.insert(opened->connection);
    if (const auto* closed = std::get_if<ConnectionClosed>(&input))
      connections_.erase(closed->connection);
    side_.handle(std::move(input), now());
    while (auto action = side_.next_action()) carry_out(std::move(*action));
  }
  settling_ = false;
  pump();
  end_if_closed();
}

void Bridge::pump() {
  for (const ConnectionId connection : connections_) network_.ready(connection);
  set_timer();
}

void Bridge::carry_out(Action&& action) {
  if (gateway_.apply(action)) return;
  std::visit(Overloaded{
                 [&](Dial& a) { network_.dial(a.connection, parts_.dial); },
                 [&](OpenGate& a) { network_.allow(a.connection, a.packet_bytes_max); },
                 [&](CloseConnection& a) { network_.close(a.connection, a.code, a.reason); },
                 [&](Authenticate& a) { authenticate(a); },
                 [&](CompressJob& a) { workers_->add(std::move(a)); },
                 [&](DecompressJob& a) { workers_->add(std::move(a)); },
                 [&](Log& a) { node_.log(a.level, a.text); },
                 [&](Stopped&) { network_.stop(); },
                 [](auto&) {},
             },
             action);
}

void Bridge::authenticate(const Authenticate& request) {
  if (!parts_.authenticator)
    return feed(Authenticated{request.connection, std::nullopt, "this side takes no logins"});
  parts_.authenticator->check(
      {request.method, request.credential, request.peer}, now(),
      [this, connection = request.connection](std::optional<Identity> identity,
                                              std::string reason) {
        feed(Authenticated{connection, std::move(identity), std::move(reason)});
      });
}

// A timer that is set too early stays: deadlines move with every packet, and setting it costs more
// than the few times that it fires for nothing.
void Bridge::set_timer() {
  const auto deadline = side_.next_deadline();
  if (!deadline || (timer_at_ && *timer_at_ <= *deadline)) return;
  timer_at_ = deadline;
  timer_.expires_at(std::chrono::steady_clock::time_point(deadline->time_since_epoch()));
  timer_.async_wait([this](const boost::system::error_code& error) {
    if (error) return;
    timer_at_.reset();
    const auto due = side_.next_deadline();
    if (due && *due <= now().steady) return feed(TimePassed{});
    set_timer();
  });
}

void Bridge::on_wake() {
  if (stopping_) return;
  settling_ = true;  // one pump for all that was ready
  const bool more = gateway_.drain([this](Input&& input) {
    side_.handle(std::move(input), now());
    while (auto action = side_.next_action()) carry_out(std::move(*action));
  });
  settle();
  if (more) boost::asio::post(io_, [this] { on_wake(); });
}

void Bridge::on_parameter_wake() {
  if (parameters_.drain()) boost::asio::post(io_, [this] { on_parameter_wake(); });
}

ros::ParameterServerOptions Bridge::parameter_options() {
  ros::ParameterServerOptions options;
  options.entries = describe_parameters(config_);
  options.set = [this](const std::vector<Parameter>& p) { return set_parameters(p); };
  options.describe = [this](const std::string& name) {
    return describe_parameter(name, config_.role);
  };
  options.use_sim_time = [this](bool on) { gateway_.set_use_sim_time(on); };
  options.wake = [this] { boost::asio::post(io_, [this] { on_parameter_wake(); }); };
  return options;
}

ros::SetResult Bridge::set_parameters(const std::vector<Parameter>& parameters) {
  Parsed parsed = apply_change(config_, parameters, {});
  if (parsed.config) {
    for (const auto& warning : parsed.config->warnings) node_.log(LogLevel::kWarn, warning);
    config_ = std::move(*parsed.config);
    feed(PolicyChanged{config_.policy});
    return {};
  }
  std::string reason;
  for (const auto& problem : parsed.problems)
    reason += (reason.empty() ? "" : "; ") + to_text(problem);
  return {false, reason};
}

void Bridge::every_second() {
  const TimePoint at = now().steady;
  // Since this timer waits in the same queue as everything else, its delay is the loop's.
  loop_lag_ms_ = std::max(0.0, static_cast<double>((at - second_due_).count()) / 1e6);
  if (!config_.status_file.empty()) write_status();
  give_memory_back();
  second_due_ = std::max(second_due_ + std::chrono::seconds(1), at);
  second_.expires_at(std::chrono::steady_clock::time_point(second_due_.time_since_epoch()));
  second_.async_wait([this](const boost::system::error_code& error) {
    if (!error && !stopping_) every_second();
  });
}

// What large messages needed, or a change of the graph, once nothing has come for some seconds
// (program.cpp keeps it till then).
void Bridge::give_memory_back() {
  const auto counters = gateway_.counters();
  const std::uint64_t moved = counters.taken + counters.published + counters.graph_readings;
  quiet_seconds_ = moved == moved_ ? quiet_seconds_ + 1 : 0;
  moved_ = moved;
  if (quiet_seconds_ == kQuietSeconds && moved > 0) malloc_trim(0);
}

void Bridge::write_status() {
  RunStatus run;
  run.node = node_.full_name();
  run.role = config_.role == Role::kServer ? "server" : "client";
  run.loop_lag_ms = loop_lag_ms_;
  run.taken = gateway_.counters().taken;
  run.published = gateway_.counters().published;
  const std::string problem =
      write_atomically(config_.status_file, to_json(side_.status(now()), run));
  if (!problem.empty() && problem != status_problem_) node_.log(LogLevel::kWarn, problem);
  status_problem_ = problem;
}

void Bridge::stop() {
  node_.log(LogLevel::kInfo, "stopping");
  feed(StopRequested{});
  stopping_ = true;
  timer_.cancel();
  second_.cancel();
  last_call_.expires_after(kStopTime);
  last_call_.async_wait([this](const boost::system::error_code&) { io_.stop(); });
  end_if_closed();
}

// Nothing but this timer keeps the loop once the connections are gone.
void Bridge::end_if_closed() {
  if (stopping_ && connections_.empty()) last_call_.cancel();
}

}  // namespace connect_bridge
