// Connections refused before a login, in a line of the log now and then.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "core/base/time.hpp"
#include "core/ports/url.hpp"

namespace connect_bridge {

// Counts refused connections: scanners, clients with a wrong address, clients that do not trust
// this server. Anybody can cause any number of them, so a single one is logged at kDebug only.
class Refusals {
 public:
  static constexpr Duration kPeriod = std::chrono::minutes(10);

  // `peer`: "203.0.113.5:51234"; `why` is text.
  void add(const std::string& peer, std::string why) {
    ++count_;
    last_from_ = host_of(peer);  // every connection has another port, which helps nobody
    last_why_ = std::move(why);
  }

  // The line about all since the one before, if it is time for it and there were any.
  [[nodiscard]] std::optional<std::string> take_line(TimePoint now) {
    if (count_ == 0 || (next_ && now < *next_)) return std::nullopt;
    next_ = now + kPeriod;
    const auto count = std::exchange(count_, 0);
    const std::string all =
        std::to_string(count) + " connections were refused before a login; the last, ";
    return (count == 1 ? "a connection was refused before a login, " : all) + "from " + last_from_ +
           ": " + last_why_;
  }

 private:
  std::uint64_t count_ = 0;
  std::string last_from_;
  std::string last_why_;
  std::optional<TimePoint> next_;
};

}  // namespace connect_bridge
