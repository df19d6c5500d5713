#include "run/hangup.hpp"

#include <unistd.h>

#include <csignal>
#include <utility>

namespace connect_bridge {

Hangup::Hangup(boost::asio::io_context& io, std::function<void()> reload)
    : signals_(io, SIGHUP), reload_(std::move(reload)), in_terminal_(::isatty(STDIN_FILENO) == 1) {}

void Hangup::wait_for_signal() {
  signals_.async_wait([this](const boost::system::error_code& error, int) {
    if (error) return;
    if (in_terminal_ && ::isatty(STDIN_FILENO) != 1) {
      std::raise(SIGTERM);
    } else {
      reload_();
    }
    wait_for_signal();
  });
}

}  // namespace connect_bridge
