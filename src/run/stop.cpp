#include "run/stop.hpp"

#include <csignal>

namespace connect_bridge {
namespace {

constexpr auto kStopTime = std::chrono::milliseconds(800);

}  // namespace

Stop::Stop(boost::asio::io_context& io, std::function<void()> begin)
    : io_(io), signals_(io, SIGINT, SIGTERM), deadline_(io), begin_(std::move(begin)) {}

void Stop::wait_for_signal() {
  signals_.async_wait([this](const boost::system::error_code& error, int) {
    if (error) return;
    if (begun_) return io_.stop();
    begun_ = true;
    deadline_.expires_after(kStopTime);
    deadline_.async_wait([this](const boost::system::error_code&) { io_.stop(); });
    begin_();
    wait_for_signal();
  });
}

}  // namespace connect_bridge
