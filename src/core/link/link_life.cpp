#include "core/link/link_life.hpp"

#include <algorithm>

namespace connect_bridge {

void LinkLife::opened(const Now& now) {
  ++connects_;
  opened_at_ = now.steady;
  offers_end_at_ = now.steady + kOffersTime;
  dead_at_.reset();
  forgotten_at_.reset();
  outlasted_ = false;
}

void LinkLife::lost(Loss loss, TimePoint silent_at, const Now& now) {
  offers_end_at_.reset();
  may_return_ = loss == Loss::kBreak || loss == Loss::kSilence;
  dead_at_ = is_dead(loss) ? now.steady : std::max(now.steady, silent_at);
  forgotten_at_ = may_return_ ? std::max(*dead_at_, kept_until(now)) : dead_at_;
}

void LinkLife::died(bool resumes, const Now& now) {
  dead_at_.reset();
  if (!resumes) forgotten_at_ = now.steady;
}

void LinkLife::give_up(const Now& now) {
  may_return_ = false;
  if (dead_at_) dead_at_ = now.steady;
  forgotten_at_ = now.steady;
}

void LinkLife::forgotten(bool resumes) {
  outlasted_ = resumes;
  forgotten_at_.reset();
}

bool LinkLife::take_offers_end(const Now& now) {
  if (!offers_end_at_ || *offers_end_at_ > now.steady) return false;
  offers_end_at_.reset();
  return true;
}

}  // namespace connect_bridge
