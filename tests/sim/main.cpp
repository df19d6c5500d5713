// The simulation: worlds of sides, graphs and networks in virtual time, one per seed.
//
//   sim [--seeds A..B | --seeds N | --seed S] [--verbose] [--stop] [--minutes M] [--threads T]
//       [--digest] [--twins] [--thin] [--driving]
//   sim --uses               what people do on thin links, one small world each
//   sim --day [--seed S]     two sides for 24 hours of bad weather, about 1,900 disturbances
//
// A failure prints the seed, its scenario, what a checker found and the command that replays it.
// With --digest only a digest of each seed and one of them all is printed (sim/digest.hpp), all
// else goes to the standard error: two programs that print the same do the same.
#include <sys/resource.h>
#include <unistd.h>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "sim/digest.hpp"
#include "sim/driving.hpp"
#include "sim/thin.hpp"
#include "sim/twins.hpp"
#include "sim/uses.hpp"
#include "sim/world.hpp"

namespace {

using connect_bridge::sim::Coverage;
using connect_bridge::sim::Digest;
using connect_bridge::sim::Driving;
using connect_bridge::sim::DrivingPlan;
using connect_bridge::sim::Judged;
using connect_bridge::sim::kJudgedCount;
using connect_bridge::sim::kJudgedNames;
using connect_bridge::sim::Scenario;
using connect_bridge::sim::Thin;
using connect_bridge::sim::ThinPlan;
using connect_bridge::sim::TwinPlan;
using connect_bridge::sim::Twins;
using connect_bridge::sim::Violation;
using connect_bridge::sim::World;
using connect_bridge::sim::WorldCounts;

struct Options {
  std::uint64_t first = 1;
  std::uint64_t last = 0;  // 0: not said
  bool verbose = false;
  bool stop = false;  // at the first failure
  bool digest = false;
  bool twins = false;    // worlds of two bridges in one graph
  bool thin = false;     // worlds of one thin link
  bool driving = false;  // worlds of operators who drive one robot
  bool uses = false;     // what people do on thin links
  bool day = false;      // worlds that live for a day
  double minutes = 0;    // > 0: go on with the next seeds for so long
  unsigned threads = std::max(1U, std::thread::hardware_concurrency());
};

struct Totals {
  std::atomic<std::uint64_t> next{0}, passed{0}, failed{0}, events{0}, delivered{0}, frames{0};
  std::atomic<std::uint64_t> moved{0}, halts{0};        // of robots
  std::atomic<std::uint64_t> takes{0}, takes_asked{0};  // by ~/drive
  Coverage coverage;                                    // under `printing`
  std::map<std::uint64_t, std::uint64_t> digests;       // by seed, under `printing`
  std::mutex printing;
};

// A seed takes milliseconds, a day some minutes with sanitizers; one that takes so long hangs.
constexpr std::chrono::seconds kSeedMax{120}, kDayMax{1800};

// From so many on some of the calls that take a wheel succeed.
constexpr std::uint64_t kTakesJudged = 100;

thread_local std::uint64_t running_seed = 0;
const char* running_mode = "";  // the option that makes a seed another world

// Ends the program when a seed does not end. One per thread that runs seeds.
class Watch {
 public:
  explicit Watch(std::chrono::seconds most) : most_(most), watcher_([this] { watch(); }) {}
  ~Watch() {
    begin(0);
    done_ = true;
    watcher_.join();
  }
  void begin(std::uint64_t seed) {
    since_ = std::chrono::steady_clock::now().time_since_epoch().count();
    seed_ = seed;
  }

 private:
  void watch() const {
    while (!done_) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      const std::uint64_t seed = seed_;
      const auto since =
          std::chrono::steady_clock::time_point{std::chrono::steady_clock::duration{since_.load()}};
      if (seed == 0 || std::chrono::steady_clock::now() - since < most_) continue;
      std::fprintf(stderr, "seed %llu does not end\n", static_cast<unsigned long long>(seed));
      std::_Exit(2);
    }
  }
  const std::chrono::seconds most_;
  std::atomic<std::chrono::steady_clock::rep> since_{0};
  std::atomic<std::uint64_t> seed_{0};
  std::atomic<bool> done_{false};
  std::thread watcher_;  // last: it uses the others
};

// A failed CONNECT_CHECK or a bad access must print its seed, too.
void on_fatal(int signal) {
  char line[160];
  const int size = std::snprintf(
      line, sizeof line, "seed %llu ends with signal %d\nreplay: sim %s--seed %llu --verbose\n",
      static_cast<unsigned long long>(running_seed), signal, running_mode,
      static_cast<unsigned long long>(running_seed));
  if (size > 0 && write(STDERR_FILENO, line, static_cast<std::size_t>(size)) < 0) std::_Exit(3);
  std::_Exit(2);
}

std::optional<std::string> run_twins(std::uint64_t seed, bool verbose, Totals& totals) {
  running_seed = seed;
  const TwinPlan plan = connect_bridge::sim::make_twins(seed);
  if (verbose)
    std::printf("twins %llu: %s\n", static_cast<unsigned long long>(seed), plan.text().c_str());
  Twins twins(plan, verbose);
  std::optional<std::string> found;
  try {
    twins.run();
  } catch (const Violation& violation) {
    found = violation.what();
  }
  const std::lock_guard lock(totals.printing);
  totals.digests[seed] = twins.digest();
  return found;
}

std::optional<std::string> run_thin(std::uint64_t seed, bool verbose, Totals& totals) {
  running_seed = seed;
  const ThinPlan plan = connect_bridge::sim::make_thin(seed);
  if (verbose)
    std::printf("thin %llu: %s\n", static_cast<unsigned long long>(seed), plan.text().c_str());
  Thin thin(plan, verbose);
  std::optional<std::string> found;
  try {
    thin.run();
    thin.check();
  } catch (const Violation& violation) {
    found = "on a thin link (" + plan.text() + "): " + violation.what();
  }
  const std::lock_guard lock(totals.printing);
  totals.coverage += thin.coverage();
  totals.digests[seed] += thin.digest();
  return found;
}

std::optional<std::string> run_driving(std::uint64_t seed, bool verbose, Totals& totals) {
  running_seed = seed;
  const DrivingPlan plan = connect_bridge::sim::make_driving(seed);
  if (verbose)
    std::printf("driving %llu: %s\n", static_cast<unsigned long long>(seed), plan.text().c_str());
  Driving driving(plan, verbose);
  std::optional<std::string> found;
  try {
    driving.run();
  } catch (const Violation& violation) {
    found = violation.what();
  }
  totals.moved += driving.moved();
  totals.halts += driving.halts();
  totals.takes += driving.takes();
  totals.takes_asked += driving.takes_asked();
  const std::lock_guard lock(totals.printing);
  totals.digests[seed] = driving.digest();
  return found;
}

// Whether all get what they must.
bool run_uses(bool verbose) {
  bool right = true;
  for (const auto& use : connect_bridge::sim::uses()) {
    std::string found = "ok";
    try {
      Thin thin(use.plan, verbose);
      thin.run();
      use.check(thin);
    } catch (const Violation& violation) {
      found = violation.what();
      right = false;
    }
    std::printf("%s: %s\n", use.what.c_str(), found.c_str());
  }
  return right;
}

Scenario scenario_of(std::uint64_t seed, const Options& options) {
  return options.day ? connect_bridge::sim::make_day(seed)
                     : connect_bridge::sim::make_scenario(seed);
}

void tell_day(std::uint64_t seed, const World& world) {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  std::printf("day %llu: %s; this process: %ld s, %ld MB at most\n",
              static_cast<unsigned long long>(seed), world.text_of_day().c_str(),
              static_cast<long>(used.ru_utime.tv_sec + used.ru_stime.tv_sec),
              used.ru_maxrss / 1024);
  std::fflush(stdout);
}

std::optional<std::string> run_seed(std::uint64_t seed, const Options& options, Totals& totals) {
  running_seed = seed;
  const bool verbose = options.verbose;
  Scenario scenario = scenario_of(seed, options);
  if (verbose)
    std::printf("seed %llu: %s\n", static_cast<unsigned long long>(seed), scenario.text().c_str());
  World world(std::move(scenario), verbose);
  std::optional<std::string> found;
  try {
    world.run();
  } catch (const Violation& violation) {
    found = violation.what();
    if (verbose) world.tell_status();
  }
  if (options.day) tell_day(seed, world);
  const WorldCounts counts = world.counts();
  totals.events += counts.events;
  totals.delivered += counts.delivered;
  totals.frames += counts.frames;
  const std::lock_guard lock(totals.printing);
  totals.coverage += counts.coverage;
  totals.digests[seed] += world.digest();
  return found;
}

std::optional<std::string> run_worlds(std::uint64_t seed, const Options& options, Totals& totals) {
  if (options.twins) return run_twins(seed, options.verbose, totals);
  if (options.thin) return run_thin(seed, options.verbose, totals);
  if (options.driving) return run_driving(seed, options.verbose, totals);
  return run_seed(seed, options, totals);
}

void work(const Options& options, std::chrono::steady_clock::time_point end, Totals& totals) {
  Watch watch(options.day ? kDayMax : kSeedMax);
  for (;;) {
    const std::uint64_t seed = options.first + totals.next++;
    const bool timed = options.minutes > 0;
    if (options.stop && totals.failed > 0) return;
    if (timed ? std::chrono::steady_clock::now() >= end : seed > options.last) return;
    watch.begin(seed);
    const auto found = run_worlds(seed, options, totals);
    if (!found) {
      ++totals.passed;
      continue;
    }
    ++totals.failed;
    const std::lock_guard lock(totals.printing);
    const auto number = static_cast<unsigned long long>(seed);
    std::FILE* out = options.digest ? stderr : stdout;
    const std::string text = options.twins     ? connect_bridge::sim::make_twins(seed).text()
                             : options.driving ? connect_bridge::sim::make_driving(seed).text()
                                               : scenario_of(seed, options).text();
    std::fprintf(out, "FAILED seed %llu: %s\n  found: %s\n  replay: sim %s--seed %llu --verbose\n",
                 number, text.c_str(), found->c_str(), running_mode, number);
    std::fflush(out);
  }
}

bool parse(int argc, char** argv, Options& options) {
  for (int i = 1; i < argc; ++i) {
    const std::string arg = argv[i];
    bool* const flag = arg == "--verbose"   ? &options.verbose
                       : arg == "--stop"    ? &options.stop
                       : arg == "--digest"  ? &options.digest
                       : arg == "--twins"   ? &options.twins
                       : arg == "--thin"    ? &options.thin
                       : arg == "--driving" ? &options.driving
                       : arg == "--uses"    ? &options.uses
                       : arg == "--day"     ? &options.day
                                            : nullptr;
    if (flag != nullptr) {
      *flag = true;
      continue;
    }
    if (++i == argc) return false;
    const std::string value = argv[i];
    const auto number = std::strtoull(value.c_str(), nullptr, 10);
    if (arg == "--seed") {
      options.first = options.last = number;
    } else if (arg == "--seeds") {
      const auto dots = value.find("..");
      options.first = dots == std::string::npos ? 1 : number;
      options.last =
          dots == std::string::npos ? number : std::strtoull(value.c_str() + dots + 2, nullptr, 10);
    } else if (arg == "--minutes") {
      options.minutes = std::strtod(value.c_str(), nullptr);
    } else if (arg == "--threads") {
      options.threads = static_cast<unsigned>(std::max(1ULL, number));
    } else {
      return false;
    }
  }
  return true;
}

void tell_digests(const Totals& totals) {
  Digest all;
  for (const auto& [seed, digest] : totals.digests) {
    all.add(seed);
    all.add(digest);
    std::printf("%llu %016llx\n", static_cast<unsigned long long>(seed),
                static_cast<unsigned long long>(digest));
  }
  std::printf("total %016llx\n", static_cast<unsigned long long>(all.value()));
}

void tell_coverage(std::FILE* out, const Coverage& coverage) {
  std::fprintf(out, "judged:\n");
  for (std::size_t i = 0; i < kJudgedCount; ++i) {
    const std::string name{kJudgedNames[i]};
    std::fprintf(out, "%12llu %s\n",
                 static_cast<unsigned long long>(coverage.of(static_cast<Judged>(i))),
                 name.c_str());
  }
}

void tell(const Options& options, const Totals& totals,
          std::chrono::steady_clock::time_point begin) {
  std::FILE* out = options.digest ? stderr : stdout;
  if (options.digest) tell_digests(totals);
  const double took =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const std::uint64_t seeds = totals.passed + totals.failed;
  std::fprintf(out, "%.1f s, %.0f seeds/s, %llu events, %llu frames, %llu deliveries\n", took,
               static_cast<double>(seeds) / took,
               static_cast<unsigned long long>(totals.events.load()),
               static_cast<unsigned long long>(totals.frames.load()),
               static_cast<unsigned long long>(totals.delivered.load()));
  if (options.driving)
    std::fprintf(out, "%llu commands moved a robot, %llu halts, %llu takes of %llu asked for\n",
                 static_cast<unsigned long long>(totals.moved.load()),
                 static_cast<unsigned long long>(totals.halts.load()),
                 static_cast<unsigned long long>(totals.takes.load()),
                 static_cast<unsigned long long>(totals.takes_asked.load()));
  if (!options.twins && !options.driving) tell_coverage(out, totals.coverage);
  std::fprintf(out, "%llu passed, %llu failed\n",
               static_cast<unsigned long long>(totals.passed.load()),
               static_cast<unsigned long long>(totals.failed.load()));
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  if (!parse(argc, argv, options)) {
    std::fprintf(stderr,
                 "usage: sim [--seeds A..B | --seeds N | --seed S] [--verbose] [--stop] "
                 "[--minutes M] [--threads T] [--digest] [--twins] [--thin] "
                 "[--driving]\n"
                 "       sim --uses             what people do on thin links\n"
                 "       sim --day [--seed S]   a pair of sides for 24 hours of bad weather\n");
    return 2;
  }
  for (const int signal : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE}) std::signal(signal, on_fatal);
  if (options.uses) return run_uses(options.verbose) ? 0 : 1;
  if (options.last == 0) options.last = options.day ? 1 : 2000;
  running_mode = options.twins     ? "--twins "
                 : options.thin    ? "--thin "
                 : options.driving ? "--driving "
                 : options.day     ? "--day "
                                   : "";
  // The memory in use in the course of a day is that of the first thread.
  if (options.verbose || options.day) options.threads = 1;
  Totals totals;
  const auto begin = std::chrono::steady_clock::now();
  const auto end = begin + std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                               std::chrono::duration<double>(options.minutes * 60));
  std::vector<std::thread> threads;
  for (unsigned i = 1; i < options.threads; ++i) {
    threads.emplace_back([&] { work(options, end, totals); });
  }
  work(options, end, totals);
  for (auto& thread : threads) thread.join();
  tell(options, totals, begin);
  // A call of ~/drive that never has an effect violates nothing that one seed could show.
  if (totals.takes_asked > kTakesJudged && totals.takes == 0) {
    std::fprintf(stderr, "no call of ~/drive has taken a wheel\n");
    return 1;
  }
  return totals.failed > 0 ? 1 : 0;
}
