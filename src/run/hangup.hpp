// SIGHUP: read the parameter file again, as for any program that runs in the background.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <functional>

namespace connect_bridge {

// Thread: that of the io_context.
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

}  // namespace connect_bridge
