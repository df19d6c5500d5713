// Calls a function once a second, and measures how late the loop does it.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <functional>

namespace connect_bridge {

// Thread: that of the io_context.
class Seconds {
 public:
  // The timer waits in the same queue as everything else, so its delay is the loop's.
  Seconds(boost::asio::io_context& io, std::function<void(double lag_ms)> tick)
      : timer_(io), tick_(std::move(tick)) {}

  void start();  // with a first tick at once
  void stop() { stopped_ = true; }

 private:
  void tick();

  boost::asio::steady_timer timer_;
  const std::function<void(double lag_ms)> tick_;
  std::chrono::steady_clock::time_point due_{};
  bool stopped_ = false;
};

}  // namespace connect_bridge
