#include "sim/day_weather.hpp"

#include <algorithm>
#include <cstdio>
#include <numeric>
#include <sstream>

namespace connect_bridge::sim {
namespace {

using namespace std::chrono_literals;

constexpr int kPath = 0;  // the only one

// In the order of DayWeather::Kind: how many of a thousand.
constexpr std::array<unsigned, 8> kPermille = {600, 110, 160, 30, 6, 24, 20, 50};
constexpr std::array<const char*, 8> kWords = {"cuts",
                                               "stalls",
                                               "changes of the path",
                                               "restarts of the client",
                                               "restarts of the server",
                                               "clocks set",
                                               "changes of a graph's loss",
                                               "troubles of a middleware"};

}  // namespace

DayWeather::DayWeather(const World& world, Rng rng, bool verbose)
    : world_(world), rng_(rng), verbose_(verbose) {
  draw(true);
}

void DayWeather::draw(bool restarts) {
  unsigned left = static_cast<unsigned>(rng_.below(1000));
  std::size_t kind = 0;
  for (; left >= kPermille[kind]; ++kind) left -= kPermille[kind];
  next_ = static_cast<Kind>(kind);
  if (!restarts && ends_process()) next_ = Kind::kCut;
}

void DayWeather::run_for(Duration how_long) {
  world_.schedule.run_until(world_.schedule.now() + how_long);
}

bool DayWeather::ends_process() const {
  return next_ == Kind::kClientRestart || next_ == Kind::kServerRestart;
}

void DayWeather::disturb(bool restarts) {
  const auto kind = static_cast<std::size_t>(next_);
  ++counts_[kind];
  if (verbose_) std::printf("%9.4f weather: %s\n", seconds(world_.schedule.now()), kWords[kind]);
  switch (next_) {
    case Kind::kCut: cut(); break;
    case Kind::kStall: stall(); break;
    case Kind::kPath: change_path(); break;
    case Kind::kServerRestart: restart(*world_.hosts[0]); break;
    case Kind::kClientRestart: restart(*world_.hosts[1]); break;
    case Kind::kClock: set_clock(); break;
    case Kind::kGraphLoss:
      world_.middleware.lose(static_cast<int>(rng_.below(2)),
                             loses_ ? static_cast<unsigned>(rng_.between(0, 100)) : 0);
      break;
    default: world_.hosts[rng_.below(2)]->report_trouble();
  }
  draw(restarts);
}

// 1 to 60 s; as many from 1 to 8 as from 8 to 60.
Duration DayWeather::outage() {
  return rng_.chance(500) ? rng_.between(1s, 8s) : rng_.between(8s, 60s);
}

// One end, both or none notice. Until it is over dials are refused, or hang.
void DayWeather::cut() {
  const Duration how_long = outage();
  const auto who = rng_.below(4);
  world_.checker.ledger().coverage().count(Judged::kBreaks);
  world_.network.cut(kPath, (who & 1) != 0, (who & 2) != 0);
  if (rng_.chance(500)) {
    world_.network.path(kPath).refuses = true;
    world_.network.disturb(kPath, how_long);
  } else {
    world_.network.stall(kPath, how_long);
  }
  run_for(how_long);
  world_.network.path(kPath).refuses = false;
}

void DayWeather::stall() {
  const Duration how_long = rng_.chance(700) ? rng_.between(20ms, 900ms) : rng_.between(900ms, 8s);
  world_.network.stall(kPath, how_long);
  run_for(how_long);
}

// From a local network to a cell at the edge of its range.
void DayWeather::change_path() {
  PathPlan plan = world_.network.path(kPath).plan;
  plan.delay = rng_.chance(500) ? rng_.between(100us, 30ms) : rng_.between(30ms, 200ms);
  plan.jitter = rng_.chance(500) ? rng_.between(0ms, plan.delay) : Duration{};
  plan.bytes_per_second = static_cast<std::uint64_t>(
      rng_.pick(std::vector<std::int64_t>{40'000, 100'000, 300'000, 1'000'000, 8'000'000}));
  plan.send_buffer = std::clamp<std::size_t>(plan.bytes_per_second / 20, 4096, 16384);
  plan.loss_permille = rng_.chance(500) ? static_cast<unsigned>(rng_.between(1, 60)) : 0;
  world_.network.change(kPath, plan);
  world_.network.disturb(kPath, 1s);
  if (rng_.chance(300)) world_.hosts[1]->network_changed();
  run_for(1s);
}

void DayWeather::end_loss() {
  loses_ = false;
  for (int graph = 0; graph < 2; ++graph) world_.middleware.lose(graph, 0);
}

void DayWeather::rest() {
  PathPlan plan = world_.network.path(kPath).plan;
  plan.bytes_per_second = std::max<std::uint64_t>(plan.bytes_per_second, 1'000'000);
  plan.loss_permille = 0;
  world_.network.change(kPath, plan);
}

void DayWeather::restart(Host& host) {
  if (rng_.chance(500)) {
    host.request_stop();
    run_for(1100ms);
  } else {
    host.crash(rng_.chance(600));
  }
  run_for(rng_.between(10ms, 10s));
  host.restart();
}

void DayWeather::set_clock() {
  const Duration by = rng_.chance(500)   ? rng_.between(-500ms, 500ms)
                      : rng_.chance(800) ? rng_.between(-20s, 20s)
                                         : rng_.between(-3600s, 3600s);
  world_.middleware.step_clock(static_cast<int>(rng_.below(2)), by);
  world_.checker.ledger().note_clock_stepped();
}

std::uint64_t DayWeather::cuts() const {
  return counts_[static_cast<std::size_t>(Kind::kCut)];
}

std::string DayWeather::text() const {
  std::ostringstream out;
  out << std::accumulate(counts_.begin(), counts_.end(), std::uint64_t{0}) << " disturbances:";
  for (std::size_t i = 0; i < kKinds; ++i)
    out << (i == 0 ? " " : ", ") << counts_[i] << " " << kWords[i];
  return out.str();
}

}  // namespace connect_bridge::sim
