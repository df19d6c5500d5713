#include "core/flow/rate_limit.hpp"

#include <algorithm>
#include <cmath>

#include "core/flow/packet_groups.hpp"

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
constexpr Duration kSavedOfVideo = std::chrono::seconds(1);
// A path may hold up messages for so long, and none is lost if they were published evenly.
constexpr Duration kSavedOfStamps = std::chrono::minutes(1);
// No clock is so fast. What stamps were ahead is soon made up for.
constexpr double kFastestClock = 1.02;

}  // namespace

Throttle::Throttle(double per_second, Duration slack)
    : per_second_(per_second > 0 ? per_second : 0), slack_(slack) {}

bool Throttle::ready(TimePoint now, Duration sooner) const {
  return per_second_ == 0 || paid_ == TimePoint::min() || now >= paid_ - slack_ - sooner;
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

// What shares windows because there are too many states.
constexpr std::uint64_t kOtherStates = ~std::uint64_t{0};

TimePoint RateLimit::after(const Windows& windows, double periods) const {
  return windows.arrived + Duration(static_cast<Duration::rep>(periods * period_));
}

std::uint64_t RateLimit::key(std::uint64_t state) const {
  if (period_ == 0) return 0;
  return states_.contains(state) ? state : kOtherStates;
}

// Windows are forgotten when new ones would let no more pass. The shared windows stay twice as
// long: what is held for them leaves before a newer message of the same state can pass by windows
// of its own.
RateLimit::Windows& RateLimit::windows_of(std::uint64_t state, TimePoint now) {
  const auto known = states_.find(state);
  if (known != states_.end()) return known->second;
  if (states_.size() >= kStatesMax || states_.contains(kOtherStates))
    std::erase_if(states_, [&](const auto& entry) {
      const double longer = entry.first == kOtherStates ? 2 : 1;
      return after(entry.second, longer * entry.second.fresh) <= now;
    });
  const bool shares = states_.size() >= kStatesMax || states_.contains(kOtherStates);
  return states_[shares ? kOtherStates : state];
}

void RateLimit::advance(Windows& windows, Stamp stamp, TimePoint now, double credit_max) {
  const auto steady = [](TimePoint at) { return at.time_since_epoch().count(); };
  const bool first = windows.arrived == TimePoint::min();
  if (!first && period_ > 0) {
    const bool stamped = stamp > windows.stamp && windows.stamp != 0;
    const auto since = [&](Duration time) { return static_cast<double>(time.count()) / period_; };
    windows.ahead = std::min(windows.ahead + kFastestClock * since(now - windows.arrived),
                             std::max(kAheadFirst, since(kSavedOfStamps)));
    const double passed = stamped ? std::min(window_of(stamp) - window_of(windows.stamp),
                                             std::max(windows.ahead, 0.0))
                                  : window_of(steady(now)) - window_of(steady(windows.arrived));
    const double credit = std::min(windows.credit + passed, credit_max);
    windows.ahead -= credit - windows.credit;
    windows.credit = credit;
  }
  windows.stamp = stamp;
  windows.arrived = now;
  idle_at_ = std::max(idle_at_, after(windows, windows.fresh));
}

bool RateLimit::admit(std::size_t bytes, Stamp stamp, TimePoint now, std::uint64_t state,
                      VideoPart part) {
  const bool is_packet = part != VideoPart::kNone;
  Windows& windows = windows_of(is_packet ? state : own_windows(state), now);
  const Duration saved = is_packet ? kSavedOfVideo : Duration::zero();
  double most = kCreditMax;
  if (is_packet && period_ > 0) most = std::max(most, static_cast<double>(saved.count()) / period_);
  if (is_packet && windows.arrived == TimePoint::min()) windows.credit = most;
  const double fresh = is_packet ? most : stamp != 0 ? kAheadFirst : 1;
  windows.fresh = std::max(windows.fresh, static_cast<float>(fresh));
  advance(windows, stamp, now, most);
  // Both or none: a message that one of them stops is not counted by the other. A video without key
  // frames goes on as PacketGroups lets it.
  const bool is_cut = part == VideoPart::kRefers && windows.cut > 0 &&
                      windows.cut <= PacketGroups::kSkippedMax;  // mutant: torn_groups
  if (is_cut || (period_ > 0 && windows.credit < 1) || !bytes_.ready(now, saved)) {
    ++windows.cut;
    return false;
  }
  windows.cut = 0;
  if (period_ > 0) windows.credit -= 1;
  bytes_.take(static_cast<double>(bytes), now);
  return true;
}

TimePoint RateLimit::leaves_at(std::uint64_t state) const {
  const auto windows = states_.find(key(state));
  if (windows == states_.end()) return bytes_.ready_at();
  return std::max(after(windows->second, 1), bytes_.ready_at());
}

bool RateLimit::idle(TimePoint now) const {
  return now >= bytes_.ready_at() && now >= idle_at_;
}

void RateLimit::leave(std::size_t bytes, TimePoint now, std::uint64_t state) {
  Windows& windows = windows_of(own_windows(state), now);
  advance(windows, windows.stamp == 0 ? 0 : windows.stamp + (now - windows.arrived).count(), now,
          kCreditMax);
  if (period_ > 0) windows.credit -= 1;
  bytes_.take(static_cast<double>(bytes), now);
}

}  // namespace connect_bridge
