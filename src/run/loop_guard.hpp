// Stops a process whose loop stands still.
#pragma once

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <string_view>
#include <thread>

namespace connect_bridge {

// Counts the ticks during which a loop has not moved. Ticks, not time: while a machine is suspended
// or a process is stopped, the clock goes on, but there are no ticks.
class Standstill {
 public:
  explicit Standstill(unsigned ticks_max) : ticks_max_(ticks_max) {}

  // `moves`: the number of moves until now. True: there was none during the last `ticks_max` ticks.
  [[nodiscard]] bool tick(std::uint64_t moves);

 private:
  const unsigned ticks_max_;
  std::uint64_t moves_ = 0;
  unsigned ticks_ = 0;
};

// A call into the middleware may never return (docs/troubles.md), and then the loop stands still:
// no link, no status and no signal is handled. So this thread waits only for its own signals and
// its own timer, and touches nothing that another thread may hold. The first SIGINT or SIGTERM sets
// the deadline by which the process exits; the deadline is the same for a loop that moves. Without
// a signal the thread stops a process whose loop has stood still for 30 s.
class LoopGuard {
 public:
  struct Limits {
    std::chrono::milliseconds tick{1000};
    unsigned ticks_max = 30;
  };
  // Called by the thread, each at most once; `stand_still` never follows `stop`.
  struct Ends {
    std::function<void()> stop;         // at the first signal
    std::function<void()> stand_still;  // in place of the next tick
  };

  // `program`: "server" or "client", for the line with the reason of the exit (code kExitFailed).
  explicit LoopGuard(std::string_view program);
  LoopGuard(Limits limits, Ends ends);
  ~LoopGuard();
  LoopGuard(const LoopGuard&) = delete;
  LoopGuard& operator=(const LoopGuard&) = delete;

  // Starts to watch: the loop has to move from now on. Any thread; once.
  void watch();
  // Reports that the loop is alive. Call it at least once in the time of all ticks. Any thread.
  void moved() { moves_.fetch_add(1, std::memory_order_relaxed); }

 private:
  void wait_for_signal();
  void wait_for_tick();

  const std::chrono::milliseconds tick_;
  const Ends ends_;
  Standstill standstill_;
  std::atomic<std::uint64_t> moves_ = 0;
  boost::asio::io_context io_{1};
  boost::asio::signal_set signals_;
  boost::asio::steady_timer timer_;
  bool stops_ = false;
  std::thread thread_;  // last: it uses the other members
};

}  // namespace connect_bridge
