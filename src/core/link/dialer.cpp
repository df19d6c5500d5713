#include "core/link/dialer.hpp"

#include <algorithm>

namespace connect_bridge {

void Dialer::failed(TimePoint now, DialFailure failure, Random& random) {
  constexpr int kDoublingsMax = 16;
  const Duration doubled = options_.retry_min * (1 << std::min(failures_, kDoublingsMax));
  const Duration longest = std::max(options_.retry_min, std::min(doubled, options_.retry_max));
  ++failures_;
  // At random, so that many clients do not return at once.
  const auto up_to = [&random](Duration most) {
    return Duration(random.below(static_cast<std::uint64_t>(most.count() + 1)));
  };
  Duration wait = longest / 2 + up_to(longest / 2);
  answers_ = failure == DialFailure::kAnswered ? std::min(answers_ + 1, kAnswersSoon + 1) : 0;
  const bool refused = failure == DialFailure::kRefused;
  const bool by_server = refused || failure == DialFailure::kPutOff;
  if (by_server || answers_ > kAnswersSoon) {
    const Duration long_wait = options_.refused_retry * (1 << (refused ? refusals_ : 0));
    wait = std::max(wait, by_server ? long_wait + up_to(long_wait / 2) : long_wait);
  }
  if (failure == DialFailure::kOtherKey)
    wait = options_.other_key_retry + up_to(options_.other_key_retry / 2);
  if (refused) refusals_ = std::min(refusals_ + 1, kRefusalsSoon);
  next_ = now + wait;
  not_before_ = by_server ? *next_ : TimePoint{};
}

}  // namespace connect_bridge
