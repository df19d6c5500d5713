// How a side ends: SIGINT or SIGTERM asks for an orderly stop that has a deadline. Further signals
// change nothing: one Ctrl-C reaches a program twice, from the terminal and from `ros2 launch`.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <functional>

namespace connect_bridge {

// Thread: that of the io_context.
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

// Active from the end of the loop to the end of the process, while the middleware shuts down:
// signals have no further effect, and SIGALRM ends a process that hangs.
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
