// The processor time of a thread: it is the same whatever else the machine does.
#pragma once

#include <time.h>

namespace bench {

// Of this thread, since it began.
inline double processor_seconds() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_nsec) * 1e-9;
}

}  // namespace bench
