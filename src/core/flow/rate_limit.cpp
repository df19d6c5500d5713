#include "core/flow/rate_limit.hpp"

#include <algorithm>

namespace connect_bridge {
namespace {

// A longer price would be as good as "never"; the limit also prevents an overflow of time points.
constexpr Duration kPriceMax = std::chrono::hours(24 * 365);

Duration price_of(double amount, double per_second) {
  const double seconds = amount / per_second;
  const double seconds_max = std::chrono::duration<double>(kPriceMax).count();
  if (!(seconds < seconds_max)) return kPriceMax;
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
}

// A camera with exactly max_rate must pass in spite of jitter of its clock and the network. A
// quarter of a period is small enough that of a source with twice the rate still only every second
// message passes.
Duration message_slack(double max_rate) {
  return max_rate > 0 ? price_of(0.25, max_rate) : Duration::zero();
}

constexpr Duration kByteSlack = std::chrono::milliseconds(100);

}  // namespace

Throttle::Throttle(double per_second, Duration slack)
    : per_second_(per_second > 0 ? per_second : 0), slack_(slack) {}

bool Throttle::ready(TimePoint now) const {
  return per_second_ == 0 || paid_ == TimePoint::min() || now >= paid_ - slack_;
}

void Throttle::take(double amount, TimePoint now) {
  // The time in which nothing came is not saved up.
  if (per_second_ > 0) paid_ = std::max(paid_, now) + price_of(amount, per_second_);
}

double Throttle::owed(TimePoint now) const {
  if (paid_ == TimePoint::min() || paid_ <= now) return 0;
  return std::chrono::duration<double>(paid_ - now).count() * per_second_;
}

RateLimit::RateLimit(double max_rate, std::uint64_t bytes_per_second_max)
    : messages_(max_rate, message_slack(max_rate)),
      bytes_(static_cast<double>(bytes_per_second_max), kByteSlack) {}

bool RateLimit::admit(std::size_t bytes, TimePoint now) {
  // Both or none: a message that one of them stops is not counted by the other.
  if (!idle(now)) return false;
  messages_.take(1, now);
  bytes_.take(static_cast<double>(bytes), now);
  return true;
}

}  // namespace connect_bridge
