#include "core/flow/path_share.hpp"

#include <algorithm>

namespace connect_bridge {
namespace {

using namespace std::chrono_literals;

constexpr double kPart = 0.5;
constexpr double kGrowth = 1.5;
constexpr double kArrives = 0.8;  // of what leaves, at least
constexpr double kHeldBack = 0.9;
constexpr Duration kStays = 3s;  // without need
// So long a queue of somebody else is never short.
constexpr Duration kSeenAlone = 2s;

}  // namespace

void PathShare::begin(const Round& round, TimePoint now) {
  if (rate_ > 0) return;
  needed_at_ = now;
  grow(round, now);
}

void PathShare::end_round(const Round& round, TimePoint now) {
  // A single bunch of packets is no rate.
  best_ += std::max(0.0, round.delivery - best_) / (round.starting ? 1 : 4);
  if (now - seen_since_ > kSeenAlone) best_is_all_ = true;
  if (rate_ == 0) return;
  if (rate_ > round.without) {
    needed_at_ = now;
  } else if (now - needed_at_ > kStays) {
    rate_ = 0;
    return;
  }
  if (now < judged_at_) return;
  if (round.delivery >= kArrives * rate_) {
    if (round.gain < kHeldBack) grow(round, now);
  } else if (!round.tcp_limits) {
    best_ = round.delivery;
    rate_ = best_is_all_ ? 0 : kPart * best_;
    best_is_all_ = true;
  }
}

void PathShare::grow(const Round& round, TimePoint now) {
  rate_ = kGrowth * std::max(rate_, std::min(round.allowed, round.delivery));
  if (best_is_all_) rate_ = std::min(rate_, kPart * best_);
  judged_at_ = now + round.answer;
}

}  // namespace connect_bridge
