#include "run/seconds.hpp"

#include <algorithm>

namespace connect_bridge {

void Seconds::start() {
  due_ = std::chrono::steady_clock::now();
  tick();
}

void Seconds::tick() {
  const auto now = std::chrono::steady_clock::now();
  tick_(std::max(0.0, std::chrono::duration<double, std::milli>(now - due_).count()));
  due_ = std::max(due_ + std::chrono::seconds(1), now);
  timer_.expires_at(due_);
  timer_.async_wait([this](const boost::system::error_code& error) {
    if (!error && !stopped_) tick();
  });
}

}  // namespace connect_bridge
