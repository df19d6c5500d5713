#include "sim/thin.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "sim/label.hpp"

namespace connect_bridge::sim {
namespace {

using namespace std::chrono_literals;

constexpr const char* kThinType = "geometry_msgs/msg/Pose";  // a state
constexpr double kShare = 0.25;                              // more or less than the others
constexpr double kHeads = 40;                                // bytes of a message's frames
constexpr double kArrives = 0.8;                             // of what the path carries

GraphPlan quick_graph() {
  GraphPlan graph;
  graph.discovery_max = 20ms;
  return graph;
}

Duration in_seconds(double seconds) {
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
}

}  // namespace

ThinPlan make_thin(std::uint64_t seed) {
  Rng rng{seed ^ 0x7e1ULL};
  ThinPlan plan;
  plan.seed = seed;
  const double rate = 20'000.0 * std::exp2(static_cast<double>(rng.below(60)) / 10);
  plan.path.bytes_per_second = static_cast<std::uint64_t>(rate);
  plan.path.delay = rng.between(2ms, 100ms);
  if (rng.chance(300)) plan.path.jitter = rng.between(1ms, 10ms);
  const int publishers = rng.chance(500) ? 1 : static_cast<int>(rng.between(2, 10));
  const bool one_topic = rng.chance(500);
  // A message takes 5 to 250 ms of the path.
  const double takes = 0.005 * std::exp2(static_cast<double>(rng.below(56)) / 10);
  static constexpr std::array<double, 6> kFactors = {0.7, 1.06, 1.2, 1.5, 2, 10};
  const double factor = kFactors[rng.below(kFactors.size())];
  ThinFlow flow;
  flow.type = kThinType;
  flow.bytes = std::max<std::size_t>(200, static_cast<std::size_t>(rate * takes));
  flow.from = rng.chance(500) ? 1 : 0;
  flow.period = in_seconds(static_cast<double>(flow.bytes) * publishers / rate / factor);
  flow.qos.depth = rng.chance(500) ? 1 : static_cast<std::uint32_t>(rng.between(2, 1000));
  if (rng.chance(500)) {
    flow.qos.reliability = Reliability::kBestEffort;
  } else if (rng.chance(300)) {
    flow.qos.durability = Durability::kTransientLocal;
    flow.qos.depth = 1;
  }
  flow.publishers = one_topic ? publishers : 1;
  for (int i = 0; i < (one_topic ? 1 : publishers); ++i) {
    flow.topic = "/now" + std::to_string(i);
    plan.flows.push_back(flow);
  }
  return plan;
}

std::string ThinPlan::text() const {
  std::ostringstream out;
  out << path.bytes_per_second << " bytes/s, " << seconds(path.delay) << " s one way, jitter "
      << seconds(path.jitter);
  for (const ThinFlow& flow : flows)
    out << "; " << flow.topic << " of " << flow.publishers << " publisher(s), " << flow.bytes
        << " bytes each " << seconds(flow.period) << " s, depth " << flow.qos.depth
        << (flow.qos.reliability == Reliability::kBestEffort ? ", best effort" : ", reliable")
        << (flow.qos.durability == Durability::kTransientLocal ? ", latched" : "")
        << (flow.from == 0 ? "" : ", to the robot");
  return out.str();
}

Thin::Thin(const ThinPlan& plan, bool verbose)
    : SmallWorld(plan.seed ^ 0x7817ULL, quick_graph(), false), plan_(plan) {
  build_bridge(Role::kServer, 0, verbose);
  build_bridge(Role::kClient, 1, verbose);
  // As the program sets it: what the path carries in a twelfth of a round trip, three segments at
  // the least (docs/flow.md section 3).
  const double twelfth = 2 * seconds(plan.path.delay) / 12;
  plan_.path.send_buffer = static_cast<std::size_t>(
      std::clamp(twelfth * static_cast<double>(plan.path.bytes_per_second), 4344.0, 16384.0));
  path_ = build_path(1, 0, plan_.path);
  for (std::size_t i = 0; i < plan_.flows.size(); ++i) add_flow(i);
  if (plan_.call_takes > 0s) make_call();
  if (plan_.break_for == 0s) return;
  schedule_.after(plan_.break_at, [this] {
    network_.path(path_).refuses = true;
    network_.cut(path_, true, true);
  });
  schedule_.after(plan_.break_at + plan_.break_for,
                  [this] { network_.path(path_).refuses = false; });
}

void Thin::build_bridge(Role role, int graph, bool verbose) {
  HostPlan plan = plan_of(role, graph);
  plan.graph_delay_max = 10ms;
  plan.options.node = "/connect" + std::to_string(graph);
  plan.options.resume_for = 60s;
  const bool is_robot = role == Role::kServer;
  plan.options.resumes_exported = is_robot;
  plan.options.resumes_imported = !is_robot;
  Rule rule = everything();
  rule.treatment = plan_.treatment;
  plan.options.policy = Policy{{rule}};
  build_host(plan, verbose);
}

void Thin::add_flow(std::size_t index) {
  const ThinFlow& flow = plan_.flows[index];
  EndpointSpec spec;
  spec.topic = flow.topic;
  spec.type = flow.type;
  spec.node_namespace = "/";
  spec.node_name = "listener";
  spec.qos = flow.qos;
  spec.qos.depth = std::max(100U, flow.qos.depth);
  spec.graph = 1 - flow.from;
  middleware_.create_reader(spec);
  spec.qos = flow.qos;
  spec.graph = flow.from;
  for (int i = 0; i < flow.publishers; ++i) {
    spec.node_name = "talker" + std::to_string(i);
    const std::size_t stream = streams_.size();
    streams_.push_back({index, middleware_.create_writer(spec), 0, {}});
    of_writer_[streams_.back().writer] = stream;
    schedule_.after(2s + rng_.between(0ns, flow.period), [this, stream] { publish(stream); });
  }
}

void Thin::publish(std::size_t index) {
  Stream& stream = streams_[index];
  const ThinFlow& flow = plan_.flows[stream.flow];
  if (flow.ends > 0s && schedule_.now() >= TimePoint{} + flow.ends) return;
  checker_.ledger().note_published(stream.writer);
  const Label label{static_cast<std::uint32_t>(stream.writer), ++stream.published};
  middleware_.publish(stream.writer,
                      Payload::adopt(make_message(flow.type, label, flow.bytes, false)));
  schedule_.after(flow.period, [this, index] { publish(index); });
}

void Thin::on_heard(const Reader&, const Label& label) {
  const int origin = static_cast<int>(label.writer);
  const TimePoint now = schedule_.now();
  const Duration age = now - checker_.ledger().published_at(origin, label.counter);
  streams_[of_writer_.at(origin)].heard.push_back({label.counter, now, age});
}

void Thin::make_call() {
  const int caller =
      build_service("/change_state", "lifecycle_msgs/srv/ChangeState", plan_.call_takes);
  schedule_.after(4s, [this, caller] {
    if (!services_.is_ready(caller)) violated("the service did not come");
    call(caller);
  });
}

// ---- what is right

Duration Thin::age_max(std::size_t bytes, std::size_t sharing) const {
  const double takes =
      static_cast<double>(bytes * sharing) / static_cast<double>(plan_.path.bytes_per_second);
  // What the kernel is to have: on a very thin path three segments are much.
  const double kernel = static_cast<double>(plan_.path.send_buffer) /
                        static_cast<double>(plan_.path.bytes_per_second);
  const double way = seconds(plan_.path.delay + plan_.path.jitter);
  return in_seconds(1.5 * (2 * takes + way + kernel) + 0.1);
}

Duration Thin::age_p99(const Stream& stream, TimePoint from) {
  std::vector<Duration> ages;
  for (const Heard& heard : stream.heard)
    if (heard.at >= from) ages.push_back(heard.age);
  if (ages.empty()) return kForever;
  std::sort(ages.begin(), ages.end());
  return ages[ages.size() * 99 / 100];
}

void Thin::check() const {
  const ThinFlow& flow = plan_.flows.front();
  const TimePoint from = TimePoint{} + 2s + 3s;
  const Duration most = age_max(flow.bytes, streams_.size());
  std::vector<double> counts;
  for (const Stream& stream : streams_) {
    checker_.ledger().coverage().count(Judged::kStates, stream.heard.size());
    const std::string who =
        "publisher " + std::to_string(stream.writer) + " of " + plan_.flows[stream.flow].topic;
    const Duration age = age_p99(stream, from);
    if (age > most)
      violated("what arrives of " + who + " is " + std::to_string(seconds(age)) +
               " s old (p99), and no more than " + std::to_string(seconds(most)) + " s are right");
    counts.push_back(
        static_cast<double>(std::count_if(stream.heard.begin(), stream.heard.end(),
                                          [&](const Heard& heard) { return heard.at >= from; })));
  }
  double sum = 0;
  for (const double count : counts) sum += count;
  const double each = sum / static_cast<double>(counts.size());
  const double span = seconds(TimePoint{} + plan_.end - from);
  const double published = span / seconds(flow.period) * static_cast<double>(streams_.size());
  const double carried = span * static_cast<double>(plan_.path.bytes_per_second) /
                         (static_cast<double>(flow.bytes) + kHeads);
  if (sum < kArrives * std::min(published, carried) - 2)
    violated("only " + std::to_string(sum) + " of " + std::to_string(std::min(published, carried)) +
             " messages arrived");
  // A difference of a message or two says nothing.
  for (const double count : counts)
    if (std::abs(count - each) > kShare * each + 2)
      violated("a publisher got " + std::to_string(count) + " messages through where the mean is " +
               std::to_string(each));
}

}  // namespace connect_bridge::sim
