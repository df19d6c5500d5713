#include "core/flow/together.hpp"

#include <algorithm>

namespace connect_bridge {
namespace {

constexpr std::size_t kRemembered = 64;  // large messages of a set that have ended
constexpr std::size_t kSetsMost = 256;
constexpr Duration kPeriodMax = std::chrono::seconds(1);
// Nothing takes longer on a link that is worth having; what follows is not held for ever.
constexpr Duration kWaitMost = std::chrono::seconds(30);

}  // namespace

Together::Large& Together::find_or_add(Set& set, Stamp stamp) {
  const auto found = std::find_if(set.large.rbegin(), set.large.rend(),
                                  [&](const Large& large) { return large.stamp == stamp; });
  if (found != set.large.rend()) return *found;
  while (set.large.size() >= kRemembered && set.large.front().under_way == 0) set.large.pop_front();
  set.newest = stamp;  // a clock may have been set back
  return set.large.emplace_back(Large{stamp, 0, false});
}

const Together::Large* Together::find(const Set& set, Stamp stamp) {
  const auto found = std::find_if(set.large.rbegin(), set.large.rend(),
                                  [&](const Large& large) { return large.stamp == stamp; });
  return found == set.large.rend() ? nullptr : &*found;
}

Together::Set& Together::set_of(const Moment& moment) {
  // Nodes come and go.
  if (sets_.size() >= kSetsMost && !sets_.contains(moment.set)) sets_.clear();
  return sets_[moment.set];
}

void Together::expect(const Moment& moment, TimePoint now) {
  Set& set = set_of(moment);
  Large& large = find_or_add(set, moment.stamp);
  ++large.under_way;
  if (large.under_way > 1 || large.left) return;  // another form of it
  if (set.came) set.period = std::min(now - *set.came, kPeriodMax);
  set.came = now;
}

void Together::end(const Moment& moment, bool left) {
  Large& large = find_or_add(set_of(moment), moment.stamp);
  if (large.under_way > 0) --large.under_way;
  large.left = large.left || left;
  changed_ = true;
}

Together::Answer Together::ask(const Moment& moment, TimePoint since, TimePoint now) const {
  const auto wait_until = [now](TimePoint until) {
    return until > now ? Answer{Verdict::kWait, until} : Answer{};
  };
  const auto found = sets_.find(moment.set);
  if (found == sets_.end()) return {};
  const Set& set = found->second;
  if (const Large* large = find(set, moment.stamp)) {
    if (large->left) return {};
    if (large->under_way > 0) return wait_until(since + kWaitMost);
    return {Verdict::kDrop};
  }
  // A large one comes no more for it if a newer one has come, or they have ended.
  if (moment.stamp < set.newest || !set.came || since - *set.came > 2 * set.period) return {};
  return wait_until(since + set.period);
}

}  // namespace connect_bridge
