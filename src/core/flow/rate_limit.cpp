#include "core/flow/rate_limit.hpp"

#include <algorithm>
#include <cmath>

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

// One for the window that a shaking source missed, one for its own.
constexpr double kCreditMax = 2;
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
    : period_(max_rate > 0 ? static_cast<double>(price_of(1, max_rate).count()) : 0),
      bytes_(static_cast<double>(bytes_per_second_max), kByteSlack) {}

double RateLimit::window_of(Stamp ns) const {
  return std::floor(static_cast<double>(ns) / period_);
}

void RateLimit::advance(Stamp stamp, TimePoint now) {
  const auto steady = [](TimePoint at) { return at.time_since_epoch().count(); };
  const bool first = arrived_ == TimePoint::min();
  if (!first && period_ > 0) {
    const bool stamped = stamp > stamp_ && stamp_ != 0;
    const double windows = stamped ? window_of(stamp) - window_of(stamp_)
                                   : window_of(steady(now)) - window_of(steady(arrived_));
    credit_ = std::min(credit_ + windows, kCreditMax);
  }
  stamp_ = stamp;
  arrived_ = now;
}

bool RateLimit::admit(std::size_t bytes, Stamp stamp, TimePoint now) {
  advance(stamp, now);
  // Both or none: a message that one of them stops is not counted by the other.
  if ((period_ > 0 && credit_ < 1) || !bytes_.ready(now)) return false;
  if (period_ > 0) credit_ -= 1;
  bytes_.take(static_cast<double>(bytes), now);
  return true;
}

TimePoint RateLimit::leaves_at() const {
  return std::max(arrived_ + Duration(static_cast<Duration::rep>(period_)), bytes_.ready_at());
}

bool RateLimit::idle(TimePoint now) const {
  return arrived_ == TimePoint::min() || now >= leaves_at();
}

void RateLimit::leave(std::size_t bytes, TimePoint now) {
  advance(stamp_ == 0 ? 0 : stamp_ + (now - arrived_).count(), now);
  if (period_ > 0) credit_ -= 1;
  bytes_.take(static_cast<double>(bytes), now);
}

}  // namespace connect_bridge
