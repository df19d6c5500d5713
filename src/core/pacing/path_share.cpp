#include "core/pacing/path_share.hpp"

#include <algorithm>

namespace connect_bridge {
namespace {

using namespace std::chrono_literals;

constexpr double kPart = 0.5;
constexpr double kGrowth = 1.5;
constexpr double kArrives = 0.75;  // of what leaves, at least; 1 / kGrowth is no more than before
constexpr double kHeldBack = 0.9;
constexpr Duration kStays = 3s;  // without need
// Another sender's queue never stays short for this long.
constexpr Duration kSeenAlone = 2s;
// By more than half of what it was, as far as TCP empties it after a loss, and this.
constexpr Duration kQueueGrows = 30ms;
// The share is half of the best: somebody else's queue that grows once must not take it away.
constexpr double kKeptOfBest = 0.25;

}  // namespace

void PathShare::begin(const Round& round, TimePoint now) {
  if (rate_ > 0) return;
  needed_at_ = now;
  queue_ = round.queue;
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
  judge(round, now);
}

void PathShare::queue_is(Duration queue) {
  if (rate_ == 0 || queue <= queue_ / 2 + kQueueGrows) return;
  // The queue is of our own making, so perhaps the path is slower than it was.
  best_ = std::max(best_ * kKeptOfBest, rate_);
  rate_ = 0;
}

void PathShare::judge(const Round& round, TimePoint now) {
  // Data that leaves now arrives a round trip later: a trial begins half an answer after the change
  // of the rate, and takes another half. If enough has arrived, and the queue still makes the
  // sender hold back, the share grows and is tried again. If not, the path carries no more for this
  // side: the share becomes half of that, or ends if the path was known alone.
  if (now < trial_.begin) return;
  if (trial_.end < trial_.begin) {
    trial_ = {now, now + round.answer / 2, round.arrived_bytes, false};
    return;
  }
  trial_.tcp_limits = trial_.tcp_limits || round.tcp_limits;
  if (now < trial_.end) return;
  const std::chrono::duration<double> took = now - trial_.begin;
  const double arrived = static_cast<double>(round.arrived_bytes - trial_.bytes) / took.count();
  const bool tcp_limits = trial_.tcp_limits;
  trial_ = {now, {}, 0, false};
  if (arrived >= kArrives * rate_) {
    if (round.gain < kHeldBack) grow(round, now);
  } else if (!tcp_limits) {
    best_ = arrived;
    rate_ = best_is_all_ ? 0 : kPart * best_;
    best_is_all_ = true;
  }
}

void PathShare::grow(const Round& round, TimePoint now) {
  rate_ = kGrowth * std::max(rate_, std::min(round.allowed, round.delivery));
  if (best_is_all_) rate_ = std::min(rate_, kPart * best_);
  trial_ = {now + round.answer / 2, {}, 0, false};
}

}  // namespace connect_bridge
