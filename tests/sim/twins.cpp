#include "sim/twins.hpp"

#include <algorithm>
#include <array>
#include <sstream>

#include "sim/label.hpp"

namespace connect_bridge::sim {
namespace {

using namespace std::chrono_literals;

constexpr Duration kFirstStart = 1s;
constexpr Duration kPeriod = 20ms;
constexpr Duration kEnd = 13s;
constexpr Duration kOver = 24s;
constexpr const char* kTwinType = "std_msgs/msg/String";
// Login, offers, the first picture of the graph and the discovery that a start waits for, on a
// quick network.
constexpr Duration kStartMax = 1500ms;
constexpr const char* kTwinService = "std_srvs/srv/Trigger";
// From the moment at which the other bridge knows: the settle time, the demand, discovery.
constexpr Duration kTakeOver = 1s;
// docs/protocol.md section 14: what a bridge waits for before it claims a topic, and a service; and
// the time in which claims arrive.
constexpr Duration kTopicWaits = 500ms;
constexpr Duration kServiceWaits = 1500ms;
constexpr Duration kClaimsCross = 250ms;
constexpr Duration kServiceSettles = 1s;
constexpr Duration kDeadAfter = 3s;
constexpr Duration kSilence = kDeadAfter + 1s;  // of a bridge, after which its claims end

GraphPlan graph_of(const TwinPlan& plan) {
  GraphPlan graph;
  graph.discovery_max = 30ms;
  graph.name_delay = plan.name_delay;
  graph.tells_claimants = plan.tells_claimants;
  graph.ids_show_process = plan.ids_show_process;
  graph.tells_origins = plan.tells_origins;
  graph.block_max = plan.block_max;
  return graph;
}

// How long nothing may come after the one that feeds has ended. `back`: to the robots' graph, which
// knows the end of a link.
Duration gap_max(const TwinPlan& plan, bool back) {
  const Duration take_over = kTakeOver + 3 * plan.block_max;
  switch (plan.end) {
    case TwinEnd::kStop:
      if (!back || !plan.two_servers) return take_over;
      return kDeadAfter + take_over;  // the close frame may be lost
    // Its claims end with its link.
    case TwinEnd::kCut:
    case TwinEnd::kSilentCut: return kDeadAfter + take_over;
    case TwinEnd::kCrash:
    case TwinEnd::kSilentCrash: return kSilence + take_over;
  }
  return take_over;
}

// How long nobody may feed where claims cross: the second one settles, demands, is discovered.
Duration gap_at_crossing(const TwinPlan& plan) {
  return kTakeOver + 3 * plan.block_max;
}

}  // namespace

TwinPlan make_twins(std::uint64_t seed) {
  Rng rng{seed ^ 0x2b1d6e5ULL};
  TwinPlan plan;
  plan.seed = seed;
  plan.two_servers = rng.chance(400);
  plan.tells_claimants = rng.chance(500);
  plan.ids_show_process = rng.chance(500);
  plan.proxies = rng.chance(500);
  if (rng.chance(300)) plan.name_delay = rng.between(1ms, 300ms);
  plan.second_start = rng.chance(300) ? Duration{rng.between(0, 30'000'000)} : rng.between(0s, 4s);
  plan.meeting = rng.chance(300) ? rng.between(1ms, 30ms) : rng.between(30ms, 1100ms);
  plan.end = static_cast<TwinEnd>(rng.below(5));
  plan.tells_origins = rng.chance(600);
  if (rng.chance(300)) plan.block_max = rng.between(2ms, 200ms);
  return plan;
}

std::string TwinPlan::text() const {
  static constexpr std::array<const char*, 5> kEnds = {"stops", "crashes", "crashes in silence",
                                                       "loses its path", "loses it in silence"};
  std::ostringstream out;
  out << (two_servers ? "two servers" : "one server") << ", the second client starts after "
      << seconds(second_start) << " s, the first knows of it after " << seconds(meeting)
      << " s more; claims " << (tells_claimants ? "tell" : "do not tell")
      << " their publishers, ids " << (ids_show_process ? "show" : "do not show")
      << " processes, samples " << (tells_origins ? "tell" : "do not tell")
      << " theirs, publishers block for " << seconds(block_max) << " s at most, "
      << (proxies ? "proxy nodes" : "no proxy nodes") << "; the one that feeds "
      << kEnds[static_cast<std::size_t>(end)];
  return out.str();
}

Twins::Twins(const TwinPlan& plan, bool verbose)
    : SmallWorld(plan.seed ^ 0x7715ULL, graph_of(plan), true), plan_(plan) {
  build_bridge(Role::kServer, 0, 0s, verbose);
  if (plan_.two_servers) build_bridge(Role::kServer, 0, 0s, verbose);
  const int first = static_cast<int>(hosts_.size());
  build_bridge(Role::kClient, 1, kFirstStart, verbose);
  build_bridge(Role::kClient, 1, kFirstStart + plan_.second_start, verbose);
  build_quick_path(first, 0);
  build_quick_path(first + 1, first - 1);
  middleware_.meet(first, first + 1,
                   TimePoint{} + kFirstStart + plan_.second_start + plan_.meeting);
  streams_.push_back(make_stream("/out", 0));
  streams_.push_back(make_stream("/back", 1));
  calls_.caller = build_service("/work", kTwinService);
  schedule_.after(kPeriod, [this] { publish(); });
  schedule_.after(kPeriod, [this] { make_call(); });
}

void Twins::build_bridge(Role role, int graph, Duration start, bool verbose) {
  HostPlan plan = plan_of(role, graph);
  plan.start = start;
  plan.graph_delay_max = 20ms;
  plan.options.node = "/connect" + std::to_string(hosts_.size());
  plan.options.policy = Policy{{everything()}};
  plan.options.dead_after = kDeadAfter;
  plan.options.proxy_nodes = plan_.proxies;
  plan.options.resume_for = 30s;
  build_host(plan, verbose);
}

void Twins::build_quick_path(int client, int server) {
  PathPlan quick;
  quick.delay = 2ms;
  path_of_[client] = build_path(client, server, quick);
}

Twins::Stream Twins::make_stream(const std::string& topic, int from) {
  EndpointSpec spec;
  spec.graph = from;
  spec.topic = topic;
  spec.type = kTwinType;
  spec.node_namespace = "/";
  spec.node_name = "talker" + std::to_string(from);
  spec.qos.depth = 100;
  Stream stream;
  stream.writer = middleware_.create_writer(spec);
  spec.node_name = "listener" + std::to_string(1 - from);
  for (const int graph : {from, 1 - from}) {
    spec.graph = graph;
    stream.reader = middleware_.create_reader(spec);
  }
  return stream;
}

void Twins::make_call() {
  schedule_.after(kPeriod, [this] { make_call(); });
  if (services_.is_ready(calls_.caller)) calls_.open[call(calls_.caller)] = schedule_.now();
}

void Twins::on_answer(RequestKey key) {
  if (calls_.first_answer == TimePoint{}) calls_.first_answer = schedule_.now();
  calls_.open.erase(static_cast<std::uint32_t>(key.number));
}

TimePoint Twins::second_start() const {
  return TimePoint{} + kFirstStart + plan_.second_start;
}

// The second one feeds when it has waited for claims, and has not heard the first one's: then also
// what was published before, as first messages. When both know of each other, one gives way as soon
// as it has read the other's claim.
bool Twins::may_come_twice(TimePoint published) const {
  const TimePoint heard = second_start() + plan_.meeting + kClaimsCross + 3 * plan_.block_max;
  return heard > second_start() + kTopicWaits && published <= heard;
}

void Twins::publish() {
  for (Stream& stream : streams_) {
    checker_.ledger().note_published(stream.writer);
    const Label label{static_cast<std::uint32_t>(stream.writer), ++stream.published};
    middleware_.publish(stream.writer, Payload::adopt(make_message(label, 64, false)));
  }
  schedule_.after(kPeriod, [this] { publish(); });
}

void Twins::on_heard(const Reader& reader, const Label& label) {
  for (Stream& stream : streams_) {
    if (stream.reader != reader.id) continue;
    if (stream.heard.empty()) stream.first_heard = schedule_.now();
    const std::uint64_t counter = label.counter;
    const auto at = std::lower_bound(stream.heard.begin(), stream.heard.end(), counter);
    if (at == stream.heard.end() || *at != counter) {
      stream.heard.insert(at, counter);
    } else if (!may_come_twice(TimePoint{} + counter * kPeriod)) {
      violated("message " + std::to_string(counter) + " of " + reader.spec.topic + " comes twice");
    }
  }
}

// The client that mirrors what the robots' graph publishes.
Host& Twins::feeder() {
  Host* found = nullptr;
  for (const auto& [client, path] : path_of_) {
    Host& host = *hosts_[static_cast<std::size_t>(client)];
    for (const auto& [id, mirror] : host.mirrors()) {
      if (mirror.made.topic != "/out") continue;
      if (found) violated("two bridges mirror one origin");
      found = &host;
    }
  }
  if (!found) violated("no bridge mirrors the origin");
  return *found;
}

void Twins::end_feeder() {
  Host& host = feeder();
  const int path = path_of_.at(host.index());
  switch (plan_.end) {
    case TwinEnd::kStop: return host.request_stop();
    case TwinEnd::kCrash: return host.crash(true);
    case TwinEnd::kSilentCrash: return host.crash(false);
    case TwinEnd::kCut:
    case TwinEnd::kSilentCut: {
      const bool noticed = plan_.end == TwinEnd::kCut;
      network_.path(path).refuses = true;
      return network_.cut(path, noticed, noticed);
    }
  }
}

// Before one of them ends: nothing is missing, and whoever is first does not wait for anybody. Only
// where both start in one millisecond, and the second claims just before it hears the first one's
// claim, and wins, nobody feeds until it has settled.
void Twins::check_start() const {
  for (const Stream& stream : streams_) {
    const std::string& topic = middleware_.writer(stream.writer).spec.topic;
    if (stream.heard.empty()) violated("nothing of " + topic + " arrived");
    const Duration waited = stream.first_heard - (TimePoint{} + kFirstStart);
    if (waited > kStartMax + 3 * plan_.block_max)
      violated(topic + " began " + std::to_string(seconds(waited)) + " s after the first start");
    const std::uint64_t missing =
        stream.heard.back() - stream.heard.front() + 1 - stream.heard.size();
    const bool at_once = plan_.second_start < 1ms;
    const auto most = at_once ? static_cast<std::uint64_t>(gap_at_crossing(plan_) / kPeriod) : 0;
    if (missing > most)
      violated(std::to_string(missing) + " messages of " + topic +
               " are missing while nothing has ended");
  }
}

void Twins::check_end(const Stream& stream, std::uint64_t ended) const {
  const std::string& topic = middleware_.writer(stream.writer).spec.topic;
  const auto most =
      static_cast<std::uint64_t>(gap_max(plan_, &stream == &streams_.back()) / kPeriod);
  std::uint64_t last = stream.heard.front();
  for (const std::uint64_t counter : stream.heard) {
    if (counter > last + 1 + most || (counter > last + 1 && last > ended + most))
      violated(std::to_string(counter - last - 1) + " messages of " + topic + " are missing");
    last = counter;
  }
  if (last + 100 < stream.published) violated(topic + " has ended with the bridge that fed it");
}

// From this moment on all calls are answered.
void Twins::check_calls(TimePoint from) const {
  const TimePoint last = schedule_.now() - kClaimsCross - 3 * plan_.block_max;
  if (calls_.first_answer == TimePoint{} || calls_.first_answer > from)
    violated("nothing is answered in time");
  for (const auto& [number, since] : calls_.open)
    if (since >= from && since <= last)
      violated("call " + std::to_string(number) + " is not answered");
}

void Twins::run() {
  schedule_.run_until(TimePoint{} + kEnd);
  check_start();
  check_calls(TimePoint{} + kFirstStart + kServiceWaits + kServiceSettles + kStartMax +
              3 * plan_.block_max);
  const std::uint64_t ended = streams_.front().published;
  end_feeder();
  schedule_.run_until(TimePoint{} + kOver);
  for (const Stream& stream : streams_) check_end(stream, ended);
  check_calls(TimePoint{} + kEnd + gap_max(plan_, false) + kServiceSettles);
}

}  // namespace connect_bridge::sim
