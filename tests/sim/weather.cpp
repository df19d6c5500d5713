#include "sim/weather.hpp"

#include <algorithm>
#include <cstdio>

namespace connect_bridge::sim {
namespace {

using namespace std::chrono_literals;

constexpr std::uint64_t kFast = 60'000'000;  // bytes per second

}  // namespace

Weather::Weather(Schedule& schedule, Network& network, std::vector<std::unique_ptr<Host>>& hosts,
                 const Scenario& scenario, Rng rng, bool verbose)
    : schedule_(schedule),
      network_(network),
      hosts_(hosts),
      scenario_(scenario),
      rng_(rng),
      verbose_(verbose) {}

void Weather::start() {
  if (scenario_.weather > 0s) {
    schedule_.after(rng_.between(scenario_.weather / 2, scenario_.weather), [this] { next(); });
  }
  for (std::size_t i = 0; i < scenario_.later_policies.size(); ++i) {
    schedule_.after(rng_.between(500ms, scenario_.chaos), [this, i] {
      if (!healed_) rng_.pick(hosts_)->set_policy(scenario_.later_policies[i]);
    });
  }
}

void Weather::next() {
  if (healed_) return;
  if (!scenario_.steady && rng_.chance(100)) {
    hosts_[rng_.below(hosts_.size())]->report_trouble();
  } else if (scenario_.crashes && rng_.chance(150)) {
    crash(*hosts_[rng_.below(hosts_.size())]);
  } else {
    disturb_path(static_cast<int>(rng_.below(scenario_.pairs.size())));  // strangers come after
  }
  schedule_.after(rng_.between(scenario_.weather / 2, scenario_.weather * 3 / 2),
                  [this] { next(); });
}

// What it can do, or what happens to it: it starts again, joins with the wrong end, cuts, or
// delays.
void Weather::disturb_relay(int path) {
  const auto what = rng_.below(4);
  if (verbose_) {
    constexpr const char* kWords[] = {"starts again", "joins with the wrong ends", "cuts",
                                      "delays"};
    std::printf("%9.4f the relay of path %d %s\n", seconds(schedule_.now()), path, kWords[what]);
  }
  switch (what) {
    case 0:
      network_.cut(path, true, true);
      refuse(path, rng_.between(100ms, 2s));
      break;
    case 1: {
      const Duration how_long = rng_.between(500ms, 5s);
      network_.cut(path, true, true);
      network_.path(path).swaps = true;
      network_.disturb(path, how_long);
      schedule_.after(how_long, [this, path] { network_.path(path).swaps = false; });
      break;
    }
    case 2: network_.cut(path, rng_.chance(500), rng_.chance(500)); break;
    default: {
      PathPlan plan = network_.path(path).plan;
      plan.relay_delay = rng_.between(100us, 300ms);
      network_.change(path, plan);
    }
  }
}

void Weather::disturb_path(int path) {
  if (network_.path(path).plan.has_relay() && rng_.chance(400)) return disturb_relay(path);
  const auto what = rng_.below(8);
  if (verbose_) {
    constexpr const char* kWords[] = {"stalls shortly",
                                      "stalls",
                                      "is cut",
                                      "is cut silently",
                                      "is cut, the client notices",
                                      "is cut, the server notices",
                                      "is cut and refuses",
                                      "changes"};
    std::printf("%9.4f path %d %s\n", seconds(schedule_.now()), path, kWords[what]);
  }
  switch (what) {
    case 0: network_.stall(path, rng_.between(20ms, 600ms)); break;
    case 1: network_.stall(path, rng_.between(600ms, 6s)); break;
    case 2: network_.cut(path, true, true); break;
    case 3: network_.cut(path, false, false); break;
    case 4:  // half-open: one end learns late
      network_.cut(path, true, false);
      break;
    case 5: network_.cut(path, false, true); break;
    case 6:
      network_.cut(path, rng_.chance(500), rng_.chance(500));
      refuse(path, rng_.between(100ms, 5s));
      break;
    default: {
      PathPlan plan = network_.path(path).plan;
      plan.delay = rng_.between(100us, 150ms);
      plan.jitter = rng_.between(0ms, plan.delay);
      network_.change(path, plan);
      for (auto& host : hosts_) host->network_changed();
    }
  }
}

void Weather::refuse(int path, Duration how_long) {
  network_.path(path).refuses = true;
  network_.disturb(path, how_long);
  schedule_.after(how_long, [this, path] { network_.path(path).refuses = false; });
}

void Weather::crash(Host& host) {
  host.crash(rng_.chance(600));
  schedule_.after(rng_.between(10ms, 4s), [&host] { host.start(); });
}

void Weather::heal() {
  healed_ = true;
  for (int i = 0; i < network_.paths(); ++i) {
    Path& path = network_.path(i);
    path.refuses = path.swaps = false;
    PathPlan plan = path.plan;
    plan.bytes_per_second = std::max(plan.bytes_per_second, kFast);
    plan.delay = std::min<Duration>(plan.delay, 30ms);
    plan.jitter = std::min<Duration>(plan.jitter, 20ms);
    plan.loss_permille = 0;
    plan.relay_delay = std::min<Duration>(plan.relay_delay, 30ms);
    plan.relay_bytes_per_second = std::max(plan.relay_bytes_per_second, kFast);
    network_.change(i, plan);
    network_.end_stall(i);
  }
  for (auto& host : hosts_) {
    host->calm();
    host->start();
  }
}

}  // namespace connect_bridge::sim
