// Samples of a local topic whose publisher the graph does not show yet.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <utility>

#include "core/base/budget.hpp"
#include "core/ports/inputs.hpp"
#include "core/topics/origins.hpp"

namespace connect_bridge {

// A sample may come before the graph shows its publisher: the middleware matches endpoints before
// it reports them. Without an origin it cannot be sent, so it waits while the graph is read again.
// A sample that then has no real publisher (a bridge's mirror, or a publisher that is gone) must
// not be forwarded. Single-threaded.
class ParkedSamples {
 public:
  static constexpr Duration kTime = std::chrono::seconds(1);
  static constexpr std::size_t kSamplesMax = 256;
  static constexpr std::uint64_t kBytesMax = 64 << 20;  // of all topics together

  explicit ParkedSamples(TopicTimers timers) : timers_(timers) {}

  // `all`: the budget that samples of all topics share. False: there is no room for the sample.
  [[nodiscard]] bool add(MessageTaken taken, Budget& all, const Now& now) {
    if (samples_.size() >= kSamplesMax || all.used() >= kBytesMax) return false;
    auto bytes = all.hold(taken.payload.size());
    samples_.push_back({std::move(taken), now.steady + kTime, std::move(bytes)});
    // All samples wait equally long, so the first one has the next deadline.
    if (samples_.size() == 1) watch();
    return true;
  }
  [[nodiscard]] bool empty() const { return samples_.empty(); }
  [[nodiscard]] bool has(const Gid& origin) const {
    return std::any_of(samples_.begin(), samples_.end(),
                       [&](const Sample& sample) { return sample.taken.origin == origin; });
  }
  // The samples are reviewed then, and not before.
  void wait_until(TimePoint time) { until_ = timers_.set(time); }
  void clear() {
    samples_.clear();
    until_.cancel();
  }

  // Gives each sample whose publisher `find(gid)` now knows (not null) to `forward(found, sample,
  // since when it waits)`, in order. Samples that have waited for kTime go to `drop(sample)`; the
  // rest stays.
  template <class Find, class Forward, class Drop>
  void review(const Now& now, const Find& find, const Forward& forward, const Drop& drop) {
    for (auto& sample : std::exchange(samples_, {})) {
      if (auto* found = find(sample.taken.origin)) {
        sample.bytes.release();
        forward(*found, std::move(sample.taken), sample.until - kTime);
      } else if (sample.until > now.steady) {
        samples_.push_back(std::move(sample));
      } else {
        drop(sample.taken);
      }
    }
    watch();
  }

 private:
  struct Sample {
    MessageTaken taken;
    TimePoint until;
    Budget::Hold bytes;
  };
  void watch() {
    until_.cancel();
    if (!samples_.empty()) until_ = timers_.set(samples_.front().until);
  }

  TopicTimers timers_;
  std::deque<Sample> samples_;
  ExportTimers::Timer until_;
};

}  // namespace connect_bridge
