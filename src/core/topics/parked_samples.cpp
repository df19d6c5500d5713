#include "core/topics/parked_samples.hpp"

#include <algorithm>
#include <utility>

namespace connect_bridge {

bool ParkedSamples::add(MessageTaken taken, Budget& all, const Now& now) {
  if (samples_.size() >= kSamplesMax || all.used() >= kBytesMax) return false;
  auto bytes = all.hold(taken.payload.size());
  samples_.push_back({std::move(taken), now.steady + kTime, std::move(bytes)});
  // They wait equally long, so the time of the first one is the next that comes.
  if (samples_.size() == 1) watch();
  return true;
}

bool ParkedSamples::has(const Gid& origin) const {
  return std::any_of(samples_.begin(), samples_.end(),
                     [&](const Sample& sample) { return sample.taken.origin == origin; });
}

void ParkedSamples::clear() {
  samples_.clear();
  until_.cancel();
}

void ParkedSamples::watch() {
  until_.cancel();
  if (!samples_.empty()) until_ = timers_.set(samples_.front().until);
}

}  // namespace connect_bridge
