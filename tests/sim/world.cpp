#include "sim/world.hpp"

#include <cstdio>
#include <set>
#include <string>
#include <utility>

#include "core/pacing/path.hpp"

namespace connect_bridge::sim {
namespace {

using namespace std::chrono_literals;

constexpr Duration kInspectEvery = 200ms;
// Time for noticing a dead link, a login that hangs until its timeout, the longest back-off, and
// discovery.
constexpr Duration kSettle = 9s;
constexpr std::uint64_t kEventsOfADay = 200'000'000;
constexpr int kDrainSeconds = 60;
constexpr int kRounds = 3;
// Discovery, twice, and the path, four times, on a healed network.
constexpr Duration kTruth = 700ms;
// From the claim of a service to its mirror, beside another bridge (docs/protocol.md section 12).
constexpr Duration kServiceMirrors = 1s;
const std::string kStrangersSecret = "stranger's secret";

}  // namespace

World::World(Scenario scenario, bool verbose)
    : scenario_(std::move(scenario)),
      rng_(scenario_.seed ^ 0x5eedULL),
      middleware_(schedule_, scenario_.graphs, rng_.fork(), *this),
      services_(schedule_, middleware_, Rng{scenario_.seed ^ 0x5e5eULL}, *this),
      network_(schedule_, rng_.fork()),
      checker_(schedule_, middleware_, network_,
               scenario_.shape == Shape::kTwoBridges || scenario_.shape == Shape::kSharedStar),
      crowd_(schedule_, middleware_, checker_.ledger(), scenario_, rng_.fork(), verbose),
      service_crowd_(schedule_, middleware_, services_, checker_.calls(), scenario_,
                     Rng{scenario_.seed ^ 0xca11ULL}, verbose),
      corner_(schedule_, middleware_, services_, checker_.ledger().coverage(),
              Rng{scenario_.seed ^ 0xc02e2ULL}) {
  if (scenario_.shape == Shape::kHostile) {
    Identity stranger;
    stranger.name = kStranger;
    scenario_.accounts[kStrangersSecret] = stranger;
  }
  if (scenario_.steady || scenario_.day) checker_.ledger().note_steady();
  build_hosts(verbose);
  weather_ =
      std::make_unique<Weather>(schedule_, network_, hosts_, scenario_, rng_.fork(), verbose);
  expectation_ = std::make_unique<Expectation>(middleware_, checker_, crowd_, hosts_,
                                               !scenario_.later_policies.empty());
  service_expectation_ = std::make_unique<ServiceExpectation>(middleware_, services_, checker_,
                                                              service_crowd_, hosts_);
  if (!scenario_.day) return;
  schedule_.allow(kEventsOfADay);
  day_ = std::make_unique<Day>(
      Day::World{schedule_, middleware_, services_, network_, checker_, crowd_, service_crowd_,
                 *expectation_, *service_expectation_, hosts_},
      rng_.fork(), verbose);
}

void World::build_hosts(bool verbose) {
  const Host::World around{schedule_, middleware_,        services_, network_,
                           checker_,  scenario_.accounts, digest_,   verbose};
  for (std::size_t i = 0; i < scenario_.hosts.size(); ++i) {
    hosts_.push_back(
        std::make_unique<Host>(static_cast<int>(i), scenario_.hosts[i], around, rng_.fork()));
  }
  for (const auto& plan : scenario_.pairs) {
    Host& client = *hosts_[static_cast<std::size_t>(plan.client)];
    Host& server = *hosts_[static_cast<std::size_t>(plan.server)];
    const int path = network_.add_path(client, server, plan.path);
    client.set_path(path);
    Pair pair{&client, &server, path, {}, plan.may_log_in};
    const auto& credential = client.plan().options.credential;
    const auto account = scenario_.accounts.find(std::string{credential.begin(), credential.end()});
    if (account != scenario_.accounts.end()) pair.identity = account->second;
    checker_.ledger().add_pair(std::move(pair));
  }
  if (scenario_.shape == Shape::kHostile) build_strangers();
}

// Two that dial the server, and one that plays the server for a client of its own.
void World::build_strangers() {
  PathPlan fast;
  fast.delay = 1ms;
  for (const std::string& secret : {kStrangersSecret, kStrangersSecret, std::string{}}) {
    strangers_.push_back(std::make_unique<Hostile>(
        schedule_, network_, rng_.fork(), secret,
        kStrangerLabels + 1 + static_cast<std::uint32_t>(strangers_.size())));
    Hostile& stranger = *strangers_.back();
    if (secret.empty()) {
      hosts_.back()->set_path(network_.add_path(*hosts_.back(), stranger, fast));
    } else {
      stranger.set_path(network_.add_path(stranger, *hosts_.front(), fast));
    }
  }
}

void World::on_delivery(const Reader& reader, const Writer& writer, const Sample& sample) {
  if (reader.spec.host >= 0) {
    hosts_[static_cast<std::size_t>(reader.spec.host)]->on_sample(reader, writer, sample);
  } else {
    checker_.on_delivery(reader, writer, sample);
    if (day_) day_->on_delivery(reader, writer, sample);
  }
}

void World::on_graph_change(int graph) {
  for (auto& host : hosts_) {
    if (host->graph() == graph) host->on_graph_change();
  }
}

void World::on_request(const Servant& servant, RequestKey key, const Payload& payload) {
  if (servant.spec.host >= 0) {
    hosts_[static_cast<std::size_t>(servant.spec.host)]->on_request(servant, key, payload);
  } else if (is_hostile(servant.spec.topic)) {
    corner_.on_request(servant, key, payload);
  } else {
    service_crowd_.on_request(servant, key, payload);
  }
}

void World::on_response(const Caller& caller, const Servant& servant, RequestKey key,
                        const Payload& payload) {
  if (caller.spec.host >= 0) {
    hosts_[static_cast<std::size_t>(caller.spec.host)]->on_response(caller, key, payload);
  } else if (is_hostile(caller.spec.topic)) {
    corner_.on_response(caller, servant, key);
  } else {
    service_crowd_.on_response(caller, servant, key, payload);
  }
}

void World::on_found(const Caller& caller) {
  if (caller.spec.host >= 0) {
    hosts_[static_cast<std::size_t>(caller.spec.host)]->on_found(caller);
  }
}

void World::on_caller_gone(const Caller& caller) {
  for (auto& host : hosts_) {
    if (host->graph() == caller.spec.graph) host->on_caller_gone(caller);
  }
}

void World::inspect() {
  for (const auto& host : hosts_) checker_.inspect(*host);
  schedule_.after(kInspectEvery, [this] { inspect(); });
}

void World::run() {
  for (auto& host : hosts_) {
    schedule_.after(host->plan().start, [&host] { host->start(); });
  }
  crowd_.start();
  service_crowd_.start();
  weather_->start();
  if (!strangers_.empty()) corner_.start(static_cast<int>(scenario_.graphs.size()));
  for (auto& stranger : strangers_) stranger->start();
  schedule_.after(kInspectEvery, [this] { inspect(); });
  if (scenario_.clock_step != 0s) {
    schedule_.after(rng_.between(1s, scenario_.chaos), [this] {
      middleware_.step_clock(0, scenario_.clock_step);
      checker_.ledger().note_clock_stepped();
    });
    checker_.ledger().note_clock_step();
  }
  if (day_) {
    day_->run();
  } else {
    run_for(scenario_.chaos);
  }

  crowd_.calm();
  service_crowd_.calm();
  weather_->heal();
  renew_late_logins();
  for (auto& stranger : strangers_) stranger->stop();
  corner_.stop();
  run_for(kSettle);
  middleware_.calm();
  drain();
  expectation_->settle();
  expectation_->check_links();
  expectation_->check_mirrors();
  if (scenario_.steady) expectation_->check_unbroken();
  expectation_->check_listeners();
  expectation_->check_missing();
  check_services();
  if (scenario_.long_goals) check_long_goals();
  check_delivery();
  check_first_words();
  check_late_subscribers();
  if (rng_.chance(500)) {
    check_no_demand();
  } else {
    check_last_words();
  }
  end();
}

// Logins end during the chaos. Where the clock was set back one would end while all is to be quiet.
void World::renew_late_logins() {
  for (const auto& pair : checker_.ledger().pairs()) {
    if (pair.server->has_late_login()) network_.cut(pair.path, true, true);
  }
}

// Bytes per second that the slowest link carries as far as its sides know: until they have measured
// a rate, what a new connection may send at once, in two of its shortest round trips.
std::uint64_t World::known_rate() const {
  double slowest = 1e9;
  for (const auto& host : hosts_) {
    for (const auto& link : host->running() ? host->status().links : std::vector<LinkStatus>{}) {
      const auto round_trip = std::chrono::duration<double>(link.clock.round_trip).count();
      const double first =
          round_trip > 0 ? connect_bridge::Path::kFirstBytes / (2 * round_trip) : slowest;
      slowest = std::min(slowest, link.rate > 0 ? link.rate : first);
    }
  }
  return static_cast<std::uint64_t>(std::max(slowest, 1000.0));
}

std::uint64_t World::backlog() const {
  std::uint64_t bytes = 0;
  for (const auto& host : hosts_)
    for (const auto& link : host->running() ? host->status().links : std::vector<LinkStatus>{})
      bytes += link.queued_bytes;
  return bytes;
}

// A hundred calls of the chaos may still be on their way over a slow path: as long as they move
// they have time.
void World::let_backlogs_leave() {
  auto left = backlog();
  if (left == 0) return;
  for (auto before = left + 1; left > 0 && left < before; left = backlog()) {
    before = left;
    run_for(3s);
  }
  run_for(kTruth);
}

void World::check_services() {
  if (scenario_.services.empty()) return;
  let_backlogs_leave();
  service_expectation_->check_mirrors();
  service_expectation_->check_action_topics();
  service_expectation_->check_nothing_pending();
  service_expectation_->begin_calls();
  run_for(service_crowd_.call_round(known_rate()));
  run_for(1s);
  service_expectation_->check_calls();
  // The mirrors are correct soon after their servers come and go.
  service_crowd_.shuffle();
  std::set<int> graphs;
  for (const auto& host : hosts_) graphs.insert(host->graph());
  const bool beside = graphs.size() < hosts_.size();
  run_for(kTruth + (beside ? kServiceMirrors : 0s));
  service_expectation_->check_mirrors();
  service_expectation_->begin_calls();
  run_for(service_crowd_.call_round(known_rate()));
  run_for(1s);
  service_expectation_->check_calls();
  service_expectation_->check_nothing_pending();
}

// Results have no time limit, and a goal may take an hour.
void World::check_long_goals() {
  service_crowd_.ask_for_results(1h);
  run_for(kTruth);
  service_expectation_->begin_calls();
  run_for(service_crowd_.call_round(known_rate()));
  run_for(1h + 1s);
  service_expectation_->check_calls();
  service_expectation_->check_nothing_pending();
}

void World::check_delivery() {
  expectation_->begin_rounds();
  for (int i = 0; i < kRounds; ++i) run_for(crowd_.publish_round(known_rate()));
  run_for(2s);
  expectation_->check_rounds();
  expectation_->check_qos();
}

void World::check_first_words() {
  crowd_.add_speakers();
  run_for(3s);
  expectation_->settle();
  expectation_->check_mirrors();
  expectation_->check_first_words();
}

// Earlier messages may still be in queues and workers, and on their way after them.
void World::drain() {
  for (int i = 0; i < kDrainSeconds && expectation_->is_under_way(); ++i) run_for(1s);
  run_for(1s);
}

void World::check_late_subscribers() {
  expectation_->add_late_subscribers(crowd_);
  run_for(2s);
  drain();  // the last samples of all that nobody had demanded come at once
  expectation_->check_late_subscribers();
}

void World::check_no_demand() {
  crowd_.remove_readers();
  run_for(1500ms);
  expectation_->begin_silence();
  run_for(crowd_.publish_round(known_rate()));
  run_for(500ms);
  expectation_->check_silence();
}

void World::check_last_words() {
  expectation_->begin_last_words();
  run_for(crowd_.last_words(known_rate()));
  run_for(2s);
  expectation_->check_last_words();
  run_for(2s);  // mirrors stay for the last samples of their origins, but not for long
  expectation_->settle();
  expectation_->check_links();
  expectation_->check_mirrors();
}

void World::end() {
  switch (scenario_.ending) {
    case Ending::kStop:
      for (auto& host : hosts_) host->request_stop();
      run_for(1100ms);
      break;
    case Ending::kSilence:
      for (int i = 0; i < network_.paths(); ++i) {
        network_.cut(i, false, false);
        network_.path(i).refuses = true;
      }
      run_for(4s);
      break;
    case Ending::kCrash:
      hosts_[rng_.below(hosts_.size())]->crash(rng_.chance(500));
      run_for(4s);
      break;
  }
}

void World::tell_status() const {
  for (const auto& host : hosts_) {
    if (!host->running()) continue;
    for (const auto& link : host->status().links) {
      std::printf("side %d, link with %s (%s), %s\n", host->index(), link.node.c_str(),
                  link.identity.c_str(), link.open ? "open" : "lost");
      for (const auto& topic : link.topics) {
        std::printf("  %s %s: %s, %u origins, %llu messages, %llu queued;",
                    topic.exported ? "exports" : "imports", topic.topic.c_str(),
                    topic.demanded ? "demanded" : "not demanded", topic.origins,
                    static_cast<unsigned long long>(topic.messages),
                    static_cast<unsigned long long>(topic.queued));
        for (std::size_t i = 0; i < kDropReasons; ++i) {
          const auto count = topic.dropped.by_reason[i];
          if (count == 0) continue;
          const auto reason = name_of(static_cast<DropReason>(i));
          std::printf(" %llu %.*s", static_cast<unsigned long long>(count),
                      static_cast<int>(reason.size()), reason.data());
        }
        std::printf("\n");
      }
    }
  }
}

WorldCounts World::counts() const {
  WorldCounts counts{schedule_.events(), checker_.deliveries().published(),
                     checker_.deliveries().delivered(), checker_.wire().frames(),
                     checker_.ledger().coverage()};
  for (const auto& stranger : strangers_) {
    counts.coverage.count(Judged::kOffences, stranger->offences());
    counts.coverage.count(Judged::kTolerated, stranger->tolerated());
  }
  return counts;
}

}  // namespace connect_bridge::sim
