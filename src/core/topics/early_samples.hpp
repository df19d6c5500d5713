// Samples of a topic that was offered to a peer, and that the peer has not demanded yet.
#pragma once

#include <cstddef>
#include <deque>
#include <memory>
#include <utility>

#include "core/base/budget.hpp"
#include "core/jobs/encoder.hpp"
#include "core/link/account.hpp"
#include "core/topics/origins.hpp"

namespace connect_bridge {

// The newest samples of a topic, kept for one link until its peer demands the topic. A peer with
// listeners will demand it. But a new publisher's first messages are taken before the offer has
// arrived there and the demand has come back. Samples are kept for at most two seconds after the
// first. Single-threaded.
class EarlySamples {
 public:
  explicit EarlySamples(TopicTimers timers) : timers_(timers) {}

  // Keeps the sample. `since`: when the first early sample of the topic was taken. `all`: the
  // budget of the early samples of all topics. `account`: the account of the link. Returns the
  // number of dropped samples (this one or the oldest ones), and the reason.
  struct Dropped {
    DropReason reason;
    std::size_t count;
  };
  [[nodiscard]] Dropped add(const OutSample& sample, TimePoint since, Budget& all,
                            const std::shared_ptr<Account>& account, const Now& now) {
    const std::size_t bytes = sample.raw.size();
    // A peer makes this side keep samples by reporting listeners, for as many topics as it likes.
    // So beyond the limits of its identity and of all, nothing new is kept. At the limits of the
    // topic the oldest sample gives way.
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
  // The peer has demanded or declined the topic, or the time for that is over: no more samples are
  // kept. Returns the samples that were kept.
  std::deque<OutSample> end() {
    over_ = true;
    until_.cancel();
    bytes_.release();
    of_account_.release();
    account_.reset();
    return std::exchange(samples_, {});
  }

  [[nodiscard]] bool is_over() const { return over_; }
  [[nodiscard]] bool is_late(const Now& now) const { return !empty() && until_.at() <= now.steady; }
  [[nodiscard]] bool empty() const { return samples_.empty(); }
  // When the topic's oldest early sample was taken, also if it was for another link.
  [[nodiscard]] TimePoint since() const { return since_; }
  [[nodiscard]] const std::deque<OutSample>& samples() const { return samples_; }

 private:
  // Longer than a bridge waits for the claims of others, and a slow path for its round trip.
  static constexpr Duration kAnswerMax = std::chrono::seconds(2);
  static constexpr std::size_t kSamplesMax = 100;             // of a topic, for one link
  static constexpr std::uint64_t kBytesMax = 1 << 20;         // the same
  static constexpr std::uint64_t kAccountBytesMax = 4 << 20;  // of all topics, for one identity
  static constexpr std::uint64_t kAllBytesMax = 16 << 20;     // of all topics

  TopicTimers timers_;
  bool over_ = false;
  std::deque<OutSample> samples_;
  TimePoint since_{};
  Budget::Hold bytes_;
  std::shared_ptr<Account> account_;
  Budget::Hold of_account_;
  ExportTimers::Timer until_;
};

}  // namespace connect_bridge
