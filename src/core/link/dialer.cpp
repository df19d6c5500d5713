#include "core/link/dialer.hpp"

#include <algorithm>

namespace connect_bridge {

void Dialer::failed(TimePoint now, DialFailure failure, Random& random) {
  constexpr int kDoublingsMax = 16;
  const Duration doubled = options_.retry_min * (1 << std::min(failures_, kDoublingsMax));
  const Duration longest = std::max(options_.retry_min, std::min(doubled, options_.retry_max));
  ++failures_;
  // Between half of it and all of it, so that many clients do not return at once.
  Duration wait =
      longest / 2 + Duration(random.below(static_cast<std::uint64_t>(longest.count() / 2 + 1)));
  answers_ = failure == DialFailure::kAnswered ? std::min(answers_ + 1, kAnswersSoon + 1) : 0;
  const bool refused = failure == DialFailure::kRefused;
  if (refused || answers_ > kAnswersSoon) wait = std::max(wait, options_.refused_retry);
  next_ = now + wait;
  not_before_ = refused ? *next_ : TimePoint{};
}

}  // namespace connect_bridge
