// Signals: orderly stop, reload, and the last steps of the process.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <functional>

namespace connect_bridge {

// The limit from the first SIGINT or SIGTERM to the exit of the process, whatever blocks it: `ros2
// launch` waits for 5 s.
inline constexpr std::chrono::milliseconds kEndTime{4800};

// Lets SIGALRM end the process after this time. Only the first call counts. Any thread.
void end_within(std::chrono::milliseconds time);

// SIGINT or SIGTERM starts an orderly stop with a deadline. Further signals change nothing: one
// Ctrl-C reaches a program twice, from the terminal and from `ros2 launch`. Runs on the thread of
// the io_context.
class Stop {
 public:
  // `begin` is called at the first signal.
  Stop(boost::asio::io_context& io, std::function<void()> begin);

  void wait_for_signal();
  [[nodiscard]] bool has_begun() const { return begun_; }
  // Everything is closed: the loop ends before the deadline.
  void finish() { deadline_.cancel(); }

 private:
  boost::asio::io_context& io_;
  boost::asio::signal_set signals_;
  boost::asio::steady_timer deadline_;
  const std::function<void()> begin_;
  bool begun_ = false;
};

// Call it at the start of a program. Until there is a Hangup, SIGHUP does not end a process without
// a terminal, for which it only means to read a file again. SIGHUP still ends a process whose
// terminal is closed.
void ignore_early_hangup();

// SIGHUP reads the parameter file again, as in any program that runs in the background. Runs on the
// thread of the io_context.
class Hangup {
 public:
  Hangup(boost::asio::io_context& io, std::function<void()> reload);

  // Handles the signal from now on. If the program's terminal was closed, the signal keeps its
  // original meaning: it is passed on as SIGTERM.
  void wait_for_signal();

 private:
  boost::asio::signal_set signals_;
  const std::function<void()> reload_;
  const bool in_terminal_;
};

// Active from the end of the loop, or from an error that ends the bridge, to the exit of the
// process. Meanwhile threads are joined and the middleware shuts down. Signals have no further
// effect, and SIGALRM ends a process that hangs: kEndTime after the signal, or a little earlier
// after an error.
class LastSteps {
 public:
  LastSteps() = default;
  LastSteps(const LastSteps&) = delete;
  LastSteps& operator=(const LastSteps&) = delete;
  ~LastSteps();

  // Call it before the previous signal handling ends.
  void begin();

 private:
  boost::asio::io_context io_;  // never runs
  boost::asio::signal_set signals_{io_};
};

}  // namespace connect_bridge
