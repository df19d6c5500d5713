#include "core/topics/early_samples.hpp"

#include <utility>

namespace connect_bridge {
namespace {

// Longer than a bridge waits for the claims of others, and a slow path for its round trip.
constexpr Duration kAnswerMax = std::chrono::seconds(2);
constexpr std::size_t kSamplesMax = 100;             // of a topic, for one link
constexpr std::uint64_t kBytesMax = 1 << 20;         // the same
constexpr std::uint64_t kAccountBytesMax = 4 << 20;  // of all topics, for one identity
constexpr std::uint64_t kAllBytesMax = 16 << 20;     // of all topics

}  // namespace

EarlySamples::Dropped EarlySamples::add(const OutSample& sample, TimePoint since, Budget& all,
                                        const std::shared_ptr<Account>& account, const Now& now) {
  const std::size_t bytes = sample.raw.size();
  // A peer makes this side keep samples just by saying that it listens, to as many topics as it
  // likes. So beyond the limits of its identity and of all nothing new is kept; within those of the
  // topic the oldest gives way.
  Budget& of_account = account->early;
  if (bytes > kBytesMax || of_account.used() + bytes > kAccountBytesMax ||
      all.used() + bytes > kAllBytesMax)
    return {DropReason::kQueueBytes, 1};
  if (bytes > all.room()) return {DropReason::kMemory, 1};
  if (empty()) {
    since_ = since;
    until_ = timers_.set(now.steady + kAnswerMax);
    bytes_ = all.hold(0);
    account_ = account;
    of_account_ = of_account.hold(0);
  }
  samples_.push_back(sample);
  std::uint64_t held = bytes_.amount() + bytes;
  std::size_t dropped = 0;
  for (; samples_.size() > kSamplesMax || held > kBytesMax; ++dropped) {
    held -= samples_.front().raw.size();
    samples_.pop_front();
  }
  bytes_.resize(held);
  of_account_.resize(held);
  return {DropReason::kQueueDepth, dropped};
}

std::deque<OutSample> EarlySamples::end() {
  over_ = true;
  until_.cancel();
  bytes_.release();
  of_account_.release();
  account_.reset();
  return std::exchange(samples_, {});
}

}  // namespace connect_bridge
