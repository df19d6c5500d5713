// What ends a process whose loop stands still.
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

// Counts for how many ticks a loop has not moved. It does not measure the time: while a machine is
// suspended or a process is stopped, a clock goes on, but there are no ticks.
class Standstill {
 public:
  explicit Standstill(unsigned ticks_max) : ticks_max_(ticks_max) {}

  // `moves`: how often the loop has moved until now. True: it has not during the last `ticks_max`
  // ticks.
  [[nodiscard]] bool tick(std::uint64_t moves);

 private:
  const unsigned ticks_max_;
  std::uint64_t moves_ = 0;
  unsigned ticks_ = 0;
};

// A call into the middleware may never return (docs/troubles.md), and the loop with
// it. Then nothing that waits for the loop happens: no link, no status, and no signal. So this is a
// thread that waits for its own signals and its own timer alone, and touches nothing that another
// thread may hold. With the first SIGINT or SIGTERM it sets the deadline by which the process ends,
// which stays what it was for a loop that moves. Without one it ends a process whose loop has stood
// still for 30 s.
class LoopGuard {
 public:
  struct Limits {
    std::chrono::milliseconds tick{1000};
    unsigned ticks_max = 30;
  };
  // Called by the thread, each at most once, the second not after the first.
  struct Ends {
    std::function<void()> stop;         // at the first signal
    std::function<void()> stand_still;  // instead of a further tick
  };

  // `program`: "server" or "client", for the line that says why it ends (exit code kExitFailed).
  explicit LoopGuard(std::string_view program);
  LoopGuard(Limits limits, Ends ends);
  ~LoopGuard();
  LoopGuard(const LoopGuard&) = delete;
  LoopGuard& operator=(const LoopGuard&) = delete;

  // From now on the loop has to move. Any thread; once.
  void watch();
  // The loop is alive: at least once in the time of all ticks. Any thread.
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
  std::thread thread_;  // last: it uses the others
};

}  // namespace connect_bridge
