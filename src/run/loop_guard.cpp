#include "run/loop_guard.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <boost/asio/post.hpp>
#include <csignal>
#include <string>
#include <utility>

#include "run/exit_codes.hpp"
#include "run/signals.hpp"

namespace connect_bridge {
namespace {

// Time limit for the line to the standard error. The loop may wait for the same output: a pipe that
// nobody reads, or a terminal that is stopped.
constexpr auto kTimeToSay = std::chrono::seconds(1);

// Writes directly, not to the log: the loop may hold the log's mutex.
[[noreturn]] void say_and_end(const std::string& line) {
  end_within(kTimeToSay);
  const ssize_t ignored = ::write(STDERR_FILENO, line.data(), line.size());
  static_cast<void>(ignored);
  ::_exit(kExitFailed);
}

// The line is made at the start, because at the end the loop may hold the lock of the heap.
LoopGuard::Ends ends_of(std::string_view program, const LoopGuard::Limits& limits) {
  const auto seconds = limits.tick * limits.ticks_max / std::chrono::seconds(1);
  std::string line = fmt::format(
      "The main loop of {0} has not moved for {1} s. Most likely it waits in the middleware: "
      "without end in Fast DDS, if a node was killed while it used shared memory (Fast DDS's issue "
      "6485); else for a disk, or for whoever reads this output. {0} ends now, with exit code {2}; "
      "what supervises it should start it again.\n",
      program, seconds, kExitFailed);
  return {[] { end_within(kEndTime); }, [line = std::move(line)] { say_and_end(line); }};
}

}  // namespace

bool Standstill::tick(std::uint64_t moves) {
  ticks_ = moves == moves_ ? ticks_ + 1 : 0;
  moves_ = moves;
  return ticks_ >= ticks_max_;
}

LoopGuard::LoopGuard(std::string_view program) : LoopGuard(Limits{}, ends_of(program, Limits{})) {}

LoopGuard::LoopGuard(Limits limits, Ends ends)
    : tick_(limits.tick),
      ends_(std::move(ends)),
      standstill_(limits.ticks_max),
      signals_(io_, SIGINT, SIGTERM),
      timer_(io_) {
  wait_for_signal();
  thread_ = std::thread([this] { io_.run(); });
}

LoopGuard::~LoopGuard() {
  io_.stop();
  thread_.join();
}

void LoopGuard::watch() {
  boost::asio::post(io_, [this] { wait_for_tick(); });
}

void LoopGuard::wait_for_signal() {
  signals_.async_wait([this](const boost::system::error_code& error, int) {
    if (error) return;
    stops_ = true;
    timer_.cancel();
    ends_.stop();
  });
}

// Each tick begins when the previous one has ended. After a pause of the whole process there is one
// tick, not as many as were missed.
void LoopGuard::wait_for_tick() {
  if (stops_) return;
  timer_.expires_after(tick_);
  timer_.async_wait([this](const boost::system::error_code&) {
    if (stops_) return;
    if (standstill_.tick(moves_.load(std::memory_order_relaxed))) return ends_.stand_still();
    wait_for_tick();
  });
}

}  // namespace connect_bridge
