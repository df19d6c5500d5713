// The time oracle of fuzz targets: what takes a thread that others wait for too long is a finding.
#pragma once

#include <algorithm>
#include <cstdio>
#include <map>
#include <string>

#include "bench/processor_time.hpp"
#include "core/base/check.hpp"

namespace connect_bridge {

template <class Work>
double seconds_for(Work work) {
  const double began = bench::processor_seconds();
  work();
  return bench::processor_seconds() - began;
}

// Seconds, here and with these sanitizers, for what takes a millisecond of a usual PC without any:
// small pieces of memory are taken, compared and given back, as the core does it.
inline double millisecond() {
  const auto work = [] {
    std::map<std::string, int> names;
    constexpr int kNames = 6000;
    for (int i = 0; i < kNames; ++i)
      names["/a/name/of/a/topic/" + std::to_string(i * 7919 % kNames)] = i;
    CONNECT_CHECK(names.size() == kNames);
  };
  double least = seconds_for(work);
  for (int i = 0; i < 4; ++i) least = std::min(least, seconds_for(work));
  return least;
}

// 5 ms are promised (docs/security.md); sanitizers slow some things more than others.
inline constexpr double kMillisecondsMax = 2 * 5;

// `measure` does it and returns the seconds that it took. What seems slow is done again, each time
// beside a millisecond of then: the processor may be slower for a while.
template <class Measure>
void check_quick(const char* what, Measure measure) {
  static const double usual = millisecond();
  double least = measure() / usual;
  for (int i = 0; i < 4 && least >= kMillisecondsMax; ++i)
    least = std::min(least, measure() / std::max(usual, millisecond()));
  if (least < kMillisecondsMax) return;
  std::fprintf(stderr, "%s takes %.1f ms\n", what, least);
  CONNECT_CHECK(!"an input takes too long");
}

// A whole input, which leaves nothing behind.
template <class Work>
int quickly(const char* what, Work work) {
  check_quick(what, [&] { return seconds_for(work); });
  return 0;
}

}  // namespace connect_bridge
