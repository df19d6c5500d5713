// What signals do.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <functional>

namespace connect_bridge {

// From the first SIGINT or SIGTERM to the end of the process, whatever holds it up: `ros2 launch`
// waits for 5 s.
inline constexpr std::chrono::milliseconds kEndTime{4800};

// SIGALRM ends the process after this time. The first call counts, further ones change nothing. Any
// thread.
void end_within(std::chrono::milliseconds time);

// SIGINT or SIGTERM asks for an orderly stop that has a deadline. Further ones change nothing: one
// Ctrl-C reaches a program twice, from the terminal and from `ros2 launch`. Thread: that of the
// io_context.
class Stop {
 public:
  // `begin` is called with the first signal.
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

// To be called at the start of a program: until there is a Hangup, SIGHUP does not end a process
// without a terminal, for which it never means more than to read a file again. It still ends one
// whose terminal is closed.
void ignore_early_hangup();

// SIGHUP: read the parameter file again, as for any program that runs in the background. Thread:
// that of the io_context.
class Hangup {
 public:
  Hangup(boost::asio::io_context& io, std::function<void()> reload);

  // Handles the signal from now on. If the program's terminal was closed, the signal has its
  // original meaning: it is passed on as SIGTERM.
  void wait_for_signal();

 private:
  boost::asio::signal_set signals_;
  const std::function<void()> reload_;
  const bool in_terminal_;
};

// Active from the end of the loop, or from an error that ends the bridge, to the end of the
// process, while threads are waited for and the middleware shuts down: signals have no further
// effect, and SIGALRM ends a process that hangs: kEndTime after the signal, or a little earlier
// after an error.
class LastSteps {
 public:
  LastSteps() = default;
  LastSteps(const LastSteps&) = delete;
  LastSteps& operator=(const LastSteps&) = delete;
  ~LastSteps();

  // To be called before the previous signal handling ends.
  void begin();

 private:
  boost::asio::io_context io_;  // never runs
  boost::asio::signal_set signals_{io_};
};

}  // namespace connect_bridge
