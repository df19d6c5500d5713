#include "sim/driving.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <sstream>

#include "core/base/cdr.hpp"
#include "sim/types.hpp"

namespace connect_bridge::sim {
namespace {

using namespace std::chrono_literals;

constexpr Duration kPeriod = 50ms;  // of a teleop node
constexpr Duration kBegin = 4s;
constexpr Duration kChaos = 40s;
constexpr Duration kCalm = 12s;  // until everything is linked and has its demand again
constexpr Duration kHeld = 1s;
constexpr Duration kAnew = 500ms;
constexpr Duration kStep = 40ms;  // the longest step of the loop
constexpr Duration kDeadAfter = 3s;
// A third of dead_after, the way there and back, and what jitter and losses add.
constexpr Duration kClockKnown = 4s;
constexpr double kUnit = 1e-12;  // of the number in a command that says which one it is
constexpr std::uint64_t kPerSource = 1 << 16;

const char* type_of(const DrivingPlan& plan) {
  return plan.stamped ? "geometry_msgs/msg/TwistStamped" : "geometry_msgs/msg/Twist";
}

// Its height says which command it is; a robot on the ground does not care.
Payload command_of(const DrivingPlan& plan, std::uint64_t number, bool moves, Stamp stamp) {
  CdrWriter writer;
  if (plan.stamped)
    writer.u32(static_cast<std::uint32_t>(stamp / kStampSecond))
        .u32(static_cast<std::uint32_t>(stamp % kStampSecond))
        .string("base");
  for (const double value :
       {moves ? 0.5 : 0.0, 0.0, static_cast<double>(number) * kUnit, 0.0, 0.0, 0.0})
    writer.u64(std::bit_cast<std::uint64_t>(value));
  return writer.take();
}

struct Read {
  double speed = 0;
  std::uint64_t number = 0;  // 0: nobody sent it
  Stamp stamp = 0;
};
Read read(const DrivingPlan& plan, ByteView message) {
  CdrReader reader(message);
  Read read;
  if (plan.stamped) {
    const Stamp seconds = *reader.u32();
    read.stamp = seconds * kStampSecond + *reader.u32();
    if (*reader.string() != "base") violated("a command has another frame");
  }
  read.speed = std::bit_cast<double>(*reader.u64());
  reader.u64();
  read.number =
      static_cast<std::uint64_t>(std::llround(std::bit_cast<double>(*reader.u64()) / kUnit));
  return read;
}

std::vector<GraphPlan> graphs_of(const DrivingPlan& plan) {
  GraphPlan graph;
  graph.discovery_max = 20ms;
  std::vector<GraphPlan> graphs{graph};
  for (const OperatorPlan& one : plan.operators) {
    graph.clock.offset = one.clock_offset.count();
    graphs.push_back(graph);
  }
  return graphs;
}

}  // namespace

DrivingPlan make_driving(std::uint64_t seed) {
  Rng rng{seed ^ 0xd21e5ULL};
  DrivingPlan plan;
  plan.seed = seed;
  plan.stamped = rng.chance(700);
  plan.logins = rng.chance(700);
  plan.crashes = rng.chance(300);
  plan.clock_steps = rng.chance(300);
  plan.takes = rng.chance(500);
  plan.withdrawals = rng.chance(400);
  if (rng.chance(500)) plan.max_age = rng.between(200ms, 1s);
  if (rng.chance(800))
    plan.halt_after = rng.pick(std::vector<Duration>{200ms, 300ms, 500ms, 1s, 3s});
  plan.path.delay = rng.between(1ms, 80ms);
  plan.path.jitter = rng.between(0ms, 40ms);
  plan.path.loss_permille = rng.chance(500) ? 20 : 0;
  plan.path.bytes_per_second = 500'000;
  const std::vector<Duration> offsets = {0s,  30ms, -30ms,       200ms,       5s,
                                         -5s, 60s,  3'600'000ms, -3'600'000ms};
  const auto count = 1 + rng.below(4);
  for (std::uint64_t i = 0; i < count; ++i) {
    OperatorPlan one;
    one.clock_offset = rng.pick(offsets);
    one.second_way = rng.chance(200);
    one.streams_zeros = i > 0 && rng.chance(150);
    plan.operators.push_back(one);
  }
  return plan;
}

std::string DrivingPlan::text() const {
  std::ostringstream out;
  out << operators.size() << " operators (" << (stamped ? "stamped" : "no stamps")
      << (logins ? ", logins" : ", no logins") << (crashes ? ", crashes" : "")
      << (takes ? ", takes" : "") << (withdrawals ? ", rights end" : "")
      << (clock_steps ? ", clocks are set" : "") << "), max_age "
      << (max_age == kForever ? 0 : seconds(max_age)) << " s, halt_after "
      << (halt_after == kForever ? 0 : seconds(halt_after)) << " s, one way " << seconds(path.delay)
      << " s, jitter " << seconds(path.jitter) << "; clocks";
  for (const OperatorPlan& one : operators)
    out << ' ' << seconds(one.clock_offset) << (one.second_way ? " (two ways)" : "")
        << (one.streams_zeros ? " (zeros)" : "");
  return out.str();
}

Driving::Driving(const DrivingPlan& plan, bool verbose)
    : SmallWorld(plan.seed ^ 0x7b1d3ULL, graphs_of(plan), true), plan_(plan) {
  checker_.set_driving(*this);
  build(verbose);
}

void Driving::build(bool verbose) {
  HostPlan robot = plan_of(Role::kServer, 0);
  robot.graph_delay_max = 20ms;
  robot.options.node = "/robot";
  robot.options.at_robot = true;
  robot.options.resumes_imported = false;
  robot.options.dead_after = kDeadAfter;
  robot.options.policy = policy();
  build_host(robot, verbose);
  EndpointSpec spec;
  spec.topic = kDriveTopic;
  spec.type = type_of(plan_);
  spec.type_hash = hash_of_type(spec.type);
  spec.node_namespace = "/";
  spec.node_name = "base";
  spec.qos.depth = 10;
  middleware_.create_reader(spec);
  for (std::size_t i = 0; i < plan_.operators.size(); ++i) {
    const int by = static_cast<int>(i);
    operators_.emplace_back();
    add_source(by);
    for (int way = 0; way < (plan_.operators[i].second_way ? 2 : 1); ++way) {
      HostPlan client = plan_of(Role::kClient, by + 1);
      client.graph_delay_max = 20ms;
      client.options.node = "/connect" + std::to_string(hosts_.size());
      client.options.resumes_exported = false;
      client.options.drive_switch = true;
      client.options.dead_after = kDeadAfter;
      client.options.policy = Policy{{everything()}};
      client.start = rng_.between(0ms, 300ms);
      if (plan_.logins) {
        const std::string secret = "secret" + std::to_string(by);
        client.options.login_method = "token";
        client.options.credential.assign(secret.begin(), secret.end());
        Identity who;
        who.name = "operator" + std::to_string(by);
        accounts_[secret] = who;
      }
      const int host = static_cast<int>(hosts_.size());
      build_host(client, verbose);
      paths_.push_back(build_path(host, 0, plan_.path));
    }
    schedule_.after(kBegin + rng_.between(0ns, kPeriod), [this, by] { tick(by); });
    schedule_.after(kBegin, [this, by] { change_mood(by); });
  }
  schedule_.after(kBegin + 1s, [this] { disturb(); });
}

Policy Driving::policy() const {
  Rule rule = everything();
  rule.treatment.max_age = plan_.max_age;
  rule.treatment.halt_after = plan_.halt_after;
  if (withdrawn_) rule.deny = {Pattern::parse(kDriveTopic).value()};
  return Policy{{rule}};
}

// ---- operators

void Driving::add_source(int by) {
  EndpointSpec spec;
  spec.graph = by + 1;
  spec.topic = kDriveTopic;
  spec.type = type_of(plan_);
  spec.type_hash = hash_of_type(spec.type);
  spec.node_namespace = "/";
  spec.node_name = "teleop" + std::to_string(sources_.size());
  spec.qos.depth = 1;
  operators_[static_cast<std::size_t>(by)].source = sources_.size();
  sources_.push_back({middleware_.create_writer(spec), by, schedule_.now(), {}});
}

void Driving::change_mood(int by) {
  Operator& one = operators_[static_cast<std::size_t>(by)];
  if (calm_) return;
  if (plan_.operators[static_cast<std::size_t>(by)].streams_zeros) {
    one.mood = Mood::kZeros;
    return;
  }
  if (rng_.chance(60)) {  // the node starts again
    middleware_.destroy_writer(sources_[one.source].writer);
    add_source(by);
  }
  if (plan_.takes && rng_.chance(250)) {
    const auto first = std::find_if(hosts_.begin() + 1, hosts_.end(),
                                    [&](const auto& host) { return host->graph() == by + 1; });
    const bool take = rng_.chance(600);
    (*first)->drive(take);
    if (take) ++takes_asked_;
  }
  const auto drawn = rng_.below(10);
  one.mood = drawn < 5 ? Mood::kLean : drawn < 6 ? Mood::kTap : Mood::kRest;
  if (one.mood == Mood::kTap) say(by, true);
  schedule_.after(rng_.between(100ms, 4s), [this, by] { change_mood(by); });
}

// A stick says its position again and again; a hand that leaves it makes one neutral.
void Driving::tick(int by) {
  Operator& one = operators_[static_cast<std::size_t>(by)];
  if (one.mood == Mood::kLean) {
    say(by, true);
  } else if (one.mood == Mood::kZeros || (one.mood == Mood::kRest && !one.has_let_go)) {
    say(by, false);
  }
  schedule_.after(kPeriod, [this, by] { tick(by); });
}

void Driving::say(int by, bool moves) {
  Operator& one = operators_[static_cast<std::size_t>(by)];
  Source& source = sources_[one.source];
  source.said.push_back({schedule_.now(), moves});
  one.has_let_go = !moves;
  checker_.ledger().note_published(source.writer);
  const std::uint64_t number = (one.source + 1) * kPerSource + source.said.size() - 1;
  middleware_.publish(source.writer, command_of(plan_, number, moves, middleware_.stamp(by + 1)));
}

void Driving::disturb() {
  if (calm_) return;
  const int path = rng_.pick(paths_);
  const Duration takes = rng_.between(50ms, 2s);
  switch (rng_.below(plan_.clock_steps ? 5 : 4)) {
    case 0:
    case 1: network_.stall(path, takes); break;
    case 2: {
      network_.path(path).refuses = true;
      cut_ = schedule_.now();
      network_.cut(path, rng_.chance(500), rng_.chance(500));
      const Duration lost = rng_.chance(300) ? rng_.between(3s, 6s) : takes;
      schedule_.after(lost, [this, path] { network_.path(path).refuses = false; });
      break;
    }
    case 3: {
      if (plan_.withdrawals && rng_.chance(500)) {
        withdraw();
        break;
      }
      if (!plan_.crashes) break;
      Host& host = *hosts_[rng_.below(hosts_.size())];
      if (!host.running()) break;
      if (&host == hosts_.front().get()) {
        crash_robot(takes);
        break;
      }
      cut_ = schedule_.now();
      host.crash(rng_.chance(500));
      schedule_.after(takes, [&host] { host.restart(); });
      break;
    }
    default: {
      const int graph = static_cast<int>(rng_.below(plan_.operators.size() + 1));
      middleware_.step_clock(graph, rng_.chance(500) ? 3600s : Duration(-3600s));
      clock_set_ = schedule_.now();
      checker_.ledger().note_clock_step();
    }
  }
  schedule_.after(rng_.between(500ms, 4s), [this] { disturb(); });
}

// A driver whose right ends is halted like one whose link ends.
void Driving::withdraw() {
  cut_ = schedule_.now();
  withdrawn_ = !withdrawn_;
  hosts_.front()->set_policy(policy());
}

// Nobody publishes a zero, and what is to be let go is forgotten with the process.
void Driving::crash_robot(Duration takes) {
  Host& robot = *hosts_.front();
  cut_ = schedule_.now();
  robot.crash(rng_.chance(500));
  last_.reset();
  taken_.reset();
  halted_.clear();
  audited_ = moved_;
  schedule_.after(takes, [&robot] { robot.restart(); });
}

// ---- what is right

bool Driving::clocks_rest() const {
  return clock_set_ == TimePoint::min() || schedule_.now() - clock_set_ > 3 * kClockKnown;
}

void Driving::on_command(const Host& host, ByteView message) {
  const TimePoint now = schedule_.now();
  const Read command = read(plan_, message);
  const bool moves = std::abs(command.speed) > 1e-3;
  check_time();
  if (command.number == 0) {
    if (moves) violated("the robot's side makes a command that moves");
    if (plan_.stamped && clocks_rest() && command.stamp != host.now().system)
      violated("a zero has not the robot's time");
    if (!last_) violated("a zero is said and nobody has moved the robot");
    if (stopped_ < last_->at) {
      ++halts_;
      halted_[sources_[last_->source].by] = now;
    }
    stopped_ = now;
    return;
  }
  const std::size_t source = command.number / kPerSource - 1;
  const std::size_t index = command.number % kPerSource;
  const Source& of = sources_.at(source);
  const Said& said = of.said.at(index);
  if (said.moves != moves) violated("a command is changed");
  // A stop does not wait until the clock of its publisher is known.
  if (!moves) {
    stopped_ = now;
    return;
  }
  if (withdrawn_) violated("an operator drives whose right has ended");
  check_age(said);
  if (plan_.stamped) check_stamp(said, of, message, host.now().system);
  check_holder(source, now);
  check_let_go(source, index);
  halted_.erase(of.by);
  ++moved_;
  last_ = Heard{now, source, index};
}

// After the last command that moves a zero comes within halt_after.
void Driving::check_time() const {
  if (!last_ || stopped_ >= last_->at || plan_.halt_after == kForever) return;
  const Duration since = schedule_.now() - last_->at;
  if (since > plan_.halt_after + kStep)
    violated("the robot was driven by a command of " + std::to_string(seconds(since)) +
             " s ago, and nobody has stopped it");
}

void Driving::check_age(const Said& said) const {
  Duration limit = plan_.max_age == kForever ? plan_.halt_after : plan_.max_age;
  if (limit == kForever || !clocks_rest()) return;
  // The offset is known to half a round trip.
  limit += plan_.path.delay + plan_.path.jitter + 450ms;
  const Duration age = schedule_.now() - said.at;
  if (age > limit) violated("a command is " + std::to_string(seconds(age)) + " s old");
}

// In the robot's clock it says when it was published, as exactly as the offset is known.
void Driving::check_stamp(const Said& said, const Source& of, ByteView message, Stamp here) const {
  if (!clocks_rest()) return;
  const Stamp published = here - (schedule_.now() - said.at).count();
  const Stamp stamp = read(plan_, message).stamp;
  const Duration error(std::abs(stamp - published));
  const Duration bound = std::max<Duration>(50ms, plan_.path.delay + plan_.path.jitter + 450ms);
  if (Duration(stamp - here) > 50ms + plan_.path.delay + plan_.path.jitter + 450ms)
    violated("a stamp is later than now");
  const bool is_exact =
      std::abs(plan_.operators[static_cast<std::size_t>(of.by)].clock_offset.count()) <= 30'000'000;
  if (error > bound + (is_exact ? 50ms : 0ms))
    violated("a stamp is wrong by " + std::to_string(seconds(error)) + " s");
}

// Between commands of two holders that move, a halt or a second.
void Driving::check_holder(std::size_t source, TimePoint now) const {
  if (taken_ && taken_->by != sources_[source].by && now - taken_->at < kHeld)
    violated("another one drives after the wheel was taken");
  if (!last_ || sources_[last_->source].by == sources_[source].by) return;
  if (now - last_->at >= kHeld) return;
  // The end of its link frees a wheel, after a halt if there is one.
  if (stopped_ >= last_->at || (plan_.halt_after == kForever && now - cut_ < 10s)) return;
  violated("two drive within " + std::to_string(seconds(now - last_->at)) + " s");
}

// Since its halt the operator has said neutral, or began a command anew, or is another publisher.
void Driving::check_let_go(std::size_t source, std::size_t index) const {
  const Source& of = sources_[source];
  const auto halted = halted_.find(of.by);
  if (halted == halted_.end() || of.made > halted->second - 1s) return;
  if (plan_.halt_after == kForever) return;
  // What was on its way when the halt came may be a neutral, too.
  const TimePoint from = halted->second - plan_.halt_after - kDeadAfter - 2s;
  for (std::size_t i = index + 1; i-- > 0;) {
    if (of.said[i].at < from) break;
    if (!of.said[i].moves) return;
    if (i > 0 && of.said[i].at - of.said[i - 1].at >= std::min(kAnew, plan_.halt_after)) return;
    if (i == 0) return;
  }
  violated("the robot moves again, and its driver has never let go");
}

void Driving::on_audit(const Audit& line) {
  if (line.event == AuditEvent::kWheelLeft) {
    audited_ += std::stoull(line.reason);
    taken_.reset();
  }
  constexpr std::string_view kNamed = "operator";
  if (line.event != AuditEvent::kWheelTaken || line.code != "taken") return;
  ++takes_;
  if (line.identity.starts_with(kNamed))
    taken_ = Taken{std::stoi(line.identity.substr(kNamed.size())), schedule_.now()};
}

// In good weather each command of who drives alone arrives, and the next driver has the wheel after
// a second of rest.
void Driving::check_calm() {
  for (std::size_t i = 0; i < operators_.size(); ++i) {
    const int by = static_cast<int>(i);
    if (plan_.operators[i].streams_zeros) continue;
    add_source(by);
    schedule_.run_until(schedule_.now() + 2s);
    const std::uint64_t before = moved_;
    operators_[i].mood = Mood::kLean;
    schedule_.run_until(schedule_.now() + 1s);
    operators_[i].mood = Mood::kRest;
    schedule_.run_until(schedule_.now() + 2s);
    const std::uint64_t said = sources_[operators_[i].source].said.size();
    // The mood changes between two ticks, and the first neutral is no command that moves.
    if (moved_ - before + 3 < said)
      violated("of " + std::to_string(said) + " commands in good weather only " +
               std::to_string(moved_ - before) + " moved the robot");
  }
}

void Driving::run() {
  schedule_.run_until(TimePoint{} + kBegin + kChaos);
  calm_ = true;
  if (withdrawn_) withdraw();
  for (Operator& one : operators_)
    if (one.mood != Mood::kZeros) one.mood = Mood::kRest;
  for (const int path : paths_) {
    network_.path(path).refuses = false;
    network_.end_stall(path);
    PathPlan quick = plan_.path;
    quick.loss_permille = 0;
    quick.jitter = 0ns;
    quick.delay = 2ms;
    network_.change(path, quick);
  }
  schedule_.run_until(schedule_.now() + kCalm);
  check_calm();
  check_time();
  if (audited_ != moved_)
    violated("the audit log says " + std::to_string(audited_) + " commands, and " +
             std::to_string(moved_) + " were published");
}

}  // namespace connect_bridge::sim
