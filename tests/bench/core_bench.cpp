// What the core's work costs in processor time, without sockets and ROS:
//
//   core_bench control          how long control messages of the worst shapes take to be read
//   core_bench steps            the longest step of the loop after packets that take a side long
//   core_bench links [N ...]    messages of 1 kB, 50 a second in both directions on each of N links
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "bench/control_shapes.hpp"
#include "bench/crowd.hpp"
#include "bench/processor_time.hpp"
#include "bench/step_shapes.hpp"
#include "core/wire/control.hpp"

namespace {

using namespace connect_bridge;

// The shortest of some times: the first one also waits for memory.
double milliseconds_for(std::string_view text) {
  double shortest = 1e9;
  for (int i = 0; i < 5; ++i) {
    const double began = bench::processor_seconds();
    static_cast<void>(decode_control(text));
    shortest = std::min(shortest, 1e3 * (bench::processor_seconds() - began));
  }
  return shortest;
}

int measure_control() {
  std::puts("         ms     bytes  shape                         outcome");
  for (const auto& [name, text] : bench::control_shapes()) {
    const auto message = decode_control(text);
    std::printf("%11.2f %9zu  %-29s %s\n", milliseconds_for(text), text.size(), name.c_str(),
                message.ok() ? "read" : message.error().message.c_str());
  }
  return 0;
}

// A packet may be taken in less than kStepMax by a side on which the peer and the graph have all
// that they may have.
int measure_steps() {
  constexpr std::uint32_t kOffered = 3800, kExported = 2000, kListeners = 1024;
  constexpr double kStepMax = 5;  // ms
  bool all_short = true;
  const auto tell = [&](const char* name, double seconds, const char* outcome) {
    const bool is_short = 1e3 * seconds <= kStepMax;
    all_short = all_short && is_short;
    std::printf("%11.2f  %-37s %s%s\n", 1e3 * seconds, name, outcome, is_short ? "" : ", long");
  };
  std::puts("         ms  packet                                outcome");
  for (const auto& [name, text, packet] : bench::step_shapes(kOffered, kListeners)) {
    double shortest = 1e9;
    bool open = true;
    for (int i = 0; i < 3; ++i) {
      bench::LoadedSide side(kOffered, kExported, kListeners);
      if (!side.open() || side.offers() < kExported) {
        std::fprintf(stderr, "the peer has %u topics\n", side.offers());
        return 1;
      }
      shortest = std::min(shortest, side.seconds_for(text, packet));
      open = side.open();
    }
    tell(name.c_str(), shortest, open ? "goes on" : "ends the link");
  }
  bench::LoadedSide ends(kOffered, kExported, kListeners);
  tell("the link's end", ends.seconds_to_end(), "over");
  return all_short ? 0 : 1;
}

int measure_links(const std::vector<std::uint32_t>& counts) {
  std::puts(
      "links  us for a message from a peer  where all send at once  for one to a peer  "
      "for the loss of a link");
  for (const std::uint32_t links : counts) {
    bench::Crowd crowd(links);
    if (crowd.flowing() != 2U * links) {
      std::fprintf(stderr, "%zu of %u topics flow\n", crowd.flowing(), 2U * links);
      return 1;
    }
    const std::uint32_t rounds = 20'000 / links + 50;
    const auto measure = [&](void (bench::Crowd::*send)(), std::uint64_t& count) {
      count = 0;
      crowd.take_seconds();
      for (std::uint32_t i = 0; i < rounds; ++i) (crowd.*send)();
      return 1e6 * crowd.take_seconds() / static_cast<double>(count);
    };
    const double up = measure(&bench::Crowd::send_up, crowd.published);
    const double at_once = measure(&bench::Crowd::send_up_at_once, crowd.published);
    const double down = measure(&bench::Crowd::send_down, crowd.sent);
    crowd.take_seconds();
    crowd.lose();
    const double loss = 1e6 * crowd.take_seconds() / links;
    std::printf("%5u %27.2f %24.2f %18.2f %23.2f\n", links, up, at_once, down, loss);
    if (crowd.published != std::uint64_t{rounds} * links ||
        crowd.sent != std::uint64_t{rounds} * links) {
      std::fprintf(stderr, "of %u messages %llu were published, and %llu sent\n", rounds * links,
                   static_cast<unsigned long long>(crowd.published),
                   static_cast<unsigned long long>(crowd.sent));
      return 1;
    }
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view what = argc > 1 ? argv[1] : "";
  if (what == "control" && argc == 2) return measure_control();
  if (what == "steps" && argc == 2) return measure_steps();
  if (what == "links") {
    std::vector<std::uint32_t> counts;
    for (int i = 2; i < argc; ++i)
      counts.push_back(static_cast<std::uint32_t>(std::strtoul(argv[i], nullptr, 10)));
    return measure_links(counts.empty() ? std::vector<std::uint32_t>{1, 60, 300} : counts);
  }
  std::fputs("usage: core_bench control | steps | links [N ...]\n", stderr);
  return 2;
}
