// Preloaded into a program: its system clock is CLOCK_AHEAD seconds ahead of this machine's.
#include <pthread.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <unistd.h>
#include <cstdlib>
#include <ctime>

namespace {

time_t ahead() {
  static const char* const text = std::getenv("CLOCK_AHEAD");
  static const time_t seconds = text == nullptr ? 0 : std::atol(text);
  return seconds;
}

}  // namespace

extern "C" {

int clock_gettime(clockid_t clock, timespec* now) noexcept {
  const auto result = static_cast<int>(syscall(SYS_clock_gettime, clock, now));
  if (result == 0 && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE))
    now->tv_sec += ahead();
  return result;
}

int gettimeofday(timeval* now, void*) noexcept {
  timespec exact{};
  clock_gettime(CLOCK_REALTIME, &exact);
  *now = {exact.tv_sec, exact.tv_nsec / 1000};
  return 0;
}

time_t time(time_t* to) noexcept {
  timespec exact{};
  clock_gettime(CLOCK_REALTIME, &exact);
  if (to != nullptr) *to = exact.tv_sec;
  return exact.tv_sec;
}

// The kernel compares a deadline with the machine's clock: without this each timed wait of Cyclone
// DDS, which waits by the system clock, would be CLOCK_AHEAD longer. A condition may wait by the
// monotonic clock instead, whose times are small.
int pthread_cond_timedwait(pthread_cond_t* condition, pthread_mutex_t* mutex,
                           const timespec* deadline) {
  constexpr time_t kYears = 1'000'000'000;
  if (deadline->tv_sec < kYears)
    return pthread_cond_clockwait(condition, mutex, CLOCK_MONOTONIC, deadline);
  const timespec here{deadline->tv_sec - ahead(), deadline->tv_nsec};
  return pthread_cond_clockwait(condition, mutex, CLOCK_REALTIME, &here);
}

}  // extern "C"
