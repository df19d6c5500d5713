#include "sim/day.hpp"

#include <malloc.h>
#include <algorithm>
#include <cstdio>
#include <sstream>

namespace connect_bridge::sim {
namespace {

using namespace std::chrono_literals;

constexpr int kHours = 24;
// Hours in which no process ends, so that what is not given back after a cut adds up.
constexpr int kSteadyFrom = 8, kSteadyTo = 20;
constexpr std::uint64_t kCutsMin = 1000;
// After a disturbance, until the next one: long enough for a dead link to be noticed, a dial or a
// login that hangs to end, and the longest back-off. With what the disturbances themselves take
// that makes about 1,900 of them a day.
constexpr Duration kPauseMin = 12s, kPauseMax = 48s;
// Until what was published is delivered; until calls that nobody answers have been given up, and
// what was kept for a process that will not come back (SideOptions::resume_for).
constexpr Duration kDelivered = 12s, kGivenUp = 95s;
constexpr Duration kDisturbanceMax = 80s, kRestTakes = 110s;
constexpr Duration kForgetEvery = 1min, kRemembered = 10min;
// Requests that a server's queue keeps (Treatment::server_queue), and how long places may be free
// until a call that waits gets one: twice as long as an exporter waits for a silent server.
constexpr std::uint32_t kServerTakes = 10;
constexpr Duration kPlacesTake = 10s;
// Questions for the time and their answers, which are acknowledged with the next data only.
constexpr std::uint64_t kSignsOfLife = 65536;
// What transient-local publishers may make a side keep at most; mostly it is a tenth.
constexpr std::uint64_t kKeptMax = 2 << 20;
// The memory in use at rest differs by the nodes that are there, by some 0.5 MB from hour to hour.
// So the least of the last hours is compared with that of the first ones.
constexpr std::size_t kGrowthMax = 1 << 20;
constexpr std::ptrdiff_t kCompared = 6;  // hours

std::size_t heap_in_use() {
  const auto info = mallinfo2();  // of the thread that the program began with
  return info.uordblks + info.hblkhd;
}

}  // namespace

Day::Day(const World& world, Rng rng, bool verbose)
    : world_(world),
      rng_(rng),
      verbose_(verbose),
      weather_({world.schedule, world.middleware, world.network, world.checker, world.hosts},
               rng_.fork(), verbose),
      streams_(world.checker.ledger(), world.crowd) {}

void Day::run_for(Duration how_long) {
  world_.schedule.run_until(world_.schedule.now() + how_long);
}

void Day::run() {
  forget();
  watch_places();
  const TimePoint begin = world_.schedule.now();
  run_for(kPauseMax);
  for (int hour = 1; hour <= kHours; ++hour) {
    const TimePoint end = begin + hour * 1h - kRestTakes;
    if (hour == kHours) begin_last_hour();
    while (world_.schedule.now() + kDisturbanceMax + kPauseMax < end)
      disturb(hour < kSteadyFrom || hour > kSteadyTo);
    world_.schedule.run_until(end);
    rest();
    weigh();
  }
  over_ = true;
  if (weather_.cuts() < kCutsMin)
    violated("only " + std::to_string(weather_.cuts()) + " connections were cut in a day");
}

// No best-effort sample is lost in it, and both processes are new: so nothing excuses what is
// missing in the tests at the end.
void Day::begin_last_hour() {
  for (const auto& host : world_.hosts) {
    streams_.begin_break();
    weather_.restart(*host);
    run_for(kPauseMax);
    streams_.end_break(std::max(world_.hosts[0]->last_open(), world_.hosts[1]->last_open()));
  }
  weather_.end_loss();
  world_.middleware.forgive();
}

void Day::disturb(bool restarts) {
  check_linked();
  if (weather_.ends_process()) streams_.begin_break();
  weather_.disturb(restarts);
  run_for(rng_.between(kPauseMin, kPauseMax));
  check_linked();
  streams_.end_break(std::max(world_.hosts[0]->last_open(), world_.hosts[1]->last_open()));
}

void Day::check_linked() const {
  world_.expectation.check_links();
}

// Nobody publishes, calls, comes or goes; the path is well.
void Day::rest() {
  weather_.rest();
  run_for(kDelivered);
  world_.crowd.pause(true);
  world_.service_crowd.pause(true);
  run_for(kGivenUp);
  world_.expectation.settle();
  world_.expectation.check_links();
  world_.expectation.check_mirrors();
  world_.expectation.check_listeners();
  world_.expectation.check_missing();
  world_.service_expectation.check_mirrors();
  world_.service_expectation.check_action_topics();
  world_.service_expectation.check_nothing_pending();
  for (const auto& host : world_.hosts) check_empty(*host);
  streams_.check_complete();
  world_.crowd.pause(false);
  world_.service_crowd.pause(false);
}

void Day::check_empty(const Host& host) const {
  const auto check = [&](std::uint64_t left, const std::string& what) {
    if (left > 0) violated(describe(host) + " has " + std::to_string(left) + what + " at rest");
  };
  const auto bound = [&](std::uint64_t bytes, std::uint64_t most, const std::string& what) {
    if (bytes > most) check(bytes, what);
  };
  const Status status = host.status();
  bound(status.memory_bytes, kKeptMax, " bytes in queues and histories");
  bound(host.held_bytes(), kKeptMax, " bytes of samples and packets");
  bound(status.shared_bytes, 2 * kKeptMax, " bytes of memory that its peers make it use");
  for (const auto& link : status.links) {
    check(link.queued_bytes, " bytes queued");
    bound(link.unacknowledged_bytes, kSignsOfLife, " bytes that nobody has acknowledged");
    for (const auto& topic : link.topics) check(topic.queued, " messages queued of " + topic.topic);
    for (const auto& service : link.services) {
      check(service.pending, " calls pending of " + service.service);
      check(service.waiting, " calls waiting of " + service.service);
    }
  }
}

// Calls wait at a service whose server has less than it takes at a time.
void Day::watch_places() {
  if (over_) return;
  std::map<std::pair<int, std::string>, TimePoint> waits;
  for (const auto& host : world_.hosts)
    for (const auto& link : host->running() ? host->status().links : std::vector<LinkStatus>{}) {
      if (!link.open) continue;
      for (const auto& s : link.services) {
        if (!s.exported || s.waiting == 0 || s.pending - s.waiting >= kServerTakes) continue;
        const std::pair key{host->index(), s.service};
        const auto known = waits_.find(key);
        const TimePoint since = known == waits_.end() ? world_.schedule.now() : known->second;
        if (since + kPlacesTake < world_.schedule.now())
          violated(std::to_string(s.waiting) + " calls of " + s.service + " wait at " +
                   describe(*host) + " although only " + std::to_string(s.pending - s.waiting) +
                   " are under way there");
        waits[key] = since;
      }
    }
  waits_ = std::move(waits);
  world_.schedule.after(1s, [this] { watch_places(); });
}

void Day::weigh() {
  heap_.push_back(heap_in_use());
  if (verbose_)
    std::printf("%9.4f %zu bytes are in use\n", seconds(world_.schedule.now()), heap_.back());
  if (std::ssize(heap_) < 2 * kCompared) return;
  const auto young = *std::min_element(heap_.begin(), heap_.begin() + kCompared);
  const auto old = *std::min_element(heap_.end() - kCompared, heap_.end());
  if (old > young + kGrowthMax)
    violated(std::to_string(old) + " bytes are in use at rest after " +
             std::to_string(heap_.size()) + " hours, " + std::to_string(young) +
             " at the beginning");
}

void Day::forget() {
  if (over_) return;
  const TimePoint now = world_.schedule.now();
  if (now.time_since_epoch() > kRemembered) {
    const TimePoint before = now - kRemembered;
    world_.checker.calls().forget(world_.services, before);
    world_.service_crowd.forget(before);
    world_.services.forget(before);
    world_.middleware.forget(before);
    world_.network.forget(before);
    world_.checker.forget(before);
    streams_.forget();
  }
  world_.schedule.after(kForgetEvery, [this] { forget(); });
}

std::string Day::text() const {
  std::ostringstream out;
  out << weather_.text() << "; " << world_.middleware.published() << " messages published, "
      << streams_.judged() << " of them judged for gaps, " << streams_.excused()
      << " lost with a process; " << world_.checker.calls().executed() << " calls executed";
  if (!heap_.empty())
    out << "; in use at rest: " << heap_.front() / 1000 << " kB after an hour, "
        << heap_.back() / 1000 << " kB after " << heap_.size();
  return out.str();
}

}  // namespace connect_bridge::sim
