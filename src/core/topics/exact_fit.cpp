#include "core/topics/exact_fit.hpp"

#include <algorithm>

namespace connect_bridge {
namespace {

constexpr double kIntervalMax = 10;  // seconds; after a longer pause, publishing begins again

}  // namespace

void ExactFit::came(TimePoint now) {
  const double since = last_ ? std::chrono::duration<double>(now - *last_).count() : 0;
  last_ = now;
  if (since <= 0 || since > kIntervalMax) return;
  interval_ = interval_ == 0 ? since : interval_ + (since - interval_) / 8;
}

std::optional<double> ExactFit::enough() const {
  if (interval_ == 0) return std::nullopt;
  return std::min(kEnoughPerSecond, kShareOfPublished / interval_);  // mutant: enough_exact
}

bool ExactFit::falls_far_short(double exact) const {
  const auto wanted = enough();
  return wanted && exact > 0 && exact < kFarShort * *wanted;
}

bool ExactFit::judge(double exact, bool is_shown, TimePoint now) {
  const auto wanted = enough();
  if (!wanted || exact <= 0) return exact_;
  if (exact_) {
    if (!is_shown || exact >= *wanted) return true;
    const bool failed = exact_since_ && now - *exact_since_ < kTry;
    times_ = failed ? std::min(2 * times_, kTimesMax) : 1;
    fits_since_.reset();
    return exact_ = false;
  }
  if (exact < kExactMargin * *wanted) {
    fits_since_.reset();
  } else if (!fits_since_) {
    fits_since_ = now;
  } else if (now - *fits_since_ >= times_ * kExactAfter) {
    exact_since_ = now;
    exact_ = true;
  }
  return exact_;
}

}  // namespace connect_bridge
