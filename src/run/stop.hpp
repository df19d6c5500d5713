// How a side ends: SIGINT or SIGTERM asks for an orderly stop that has a deadline. Further ones
// mean the same: one Ctrl-C reaches a program twice, from the terminal and from `ros2 launch`.
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
  // Nothing is left to do in good order: the loop ends before the deadline.
  void finish() { deadline_.cancel(); }

 private:
  boost::asio::io_context& io_;
  boost::asio::signal_set signals_;
  boost::asio::steady_timer deadline_;
  const std::function<void()> begin_;
  bool begun_ = false;
};

// From the end of the loop to that of the process, while the middleware ends: signals still mean
// the stop that is under way, and SIGALRM ends what hangs.
class LastSteps {
 public:
  LastSteps() = default;
  LastSteps(const LastSteps&) = delete;
  LastSteps& operator=(const LastSteps&) = delete;
  ~LastSteps();

  // Before whatever has handled signals until now goes.
  void begin();

 private:
  boost::asio::io_context io_;  // never runs
  boost::asio::signal_set signals_{io_};
};

}  // namespace connect_bridge
