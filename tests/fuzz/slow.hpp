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

// What takes a millisecond of a usual PC without sanitizers, on this machine and with them: small
// pieces of memory are taken, compared and given back, as the core does it.
inline double millisecond() {
  static const double seconds = [] {
    const auto work = [] {
      std::map<std::string, int> names;
      for (int i = 0; i < 3000; ++i)
        names["/a/name/of/a/topic/" + std::to_string(i * 7919 % 3000)] = i;
      CONNECT_CHECK(names.size() == 3000);
    };
    double least = seconds_for(work);
    for (int i = 0; i < 10; ++i) least = std::min(least, seconds_for(work));
    return least;
  }();
  return seconds;
}

// The bound of a single input.
inline constexpr double kMillisecondsMax = 5;

// `measure` does it and returns the seconds that it took; what is slow is measured again, since the
// processor may have been slower just then.
template <class Measure>
void check_quick(const char* what, Measure measure) {
  const double most = kMillisecondsMax * millisecond();
  double least = measure();
  for (int i = 0; i < 4 && least >= most; ++i) least = std::min(least, measure());
  if (least < most) return;
  std::fprintf(stderr, "%s: %.1f ms here, of which %.1f are a millisecond\n", what, 1e3 * least,
               1e3 * millisecond());
  CONNECT_CHECK(!"an input takes too long");
}

// A whole input, which leaves nothing behind.
template <class Work>
int quickly(const char* what, Work work) {
  check_quick(what, [&] { return seconds_for(work); });
  return 0;
}

}  // namespace connect_bridge
