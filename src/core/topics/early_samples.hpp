// Samples of a topic that was offered to a peer and that the peer has not demanded yet.
#pragma once

#include <cstddef>
#include <deque>
#include <memory>

#include "core/base/budget.hpp"
#include "core/jobs/encoder.hpp"
#include "core/link/account.hpp"
#include "core/topics/origins.hpp"

namespace connect_bridge {

// A peer that listens will demand the topic, but a new publisher's first messages are taken before
// the offer has arrived and the demand has come back. Until then the newest samples are kept for
// each link that listens, for at most two seconds after the first. Those of one link; single-
// threaded.
class EarlySamples {
 public:
  explicit EarlySamples(TopicTimers timers) : timers_(timers) {}

  // Keeps the sample, `since` when the topic's samples are early. `all`: what the early samples of
  // all topics hold; `account`: of the link. Returns how many had to be dropped, it or the oldest,
  // and why.
  struct Dropped {
    DropReason reason;
    std::size_t count;
  };
  [[nodiscard]] Dropped add(const OutSample& sample, TimePoint since, Budget& all,
                            const std::shared_ptr<Account>& account, const Now& now);
  // The peer has said whether it wants the topic, or its time is over: nothing more is to be kept.
  // Returns what was.
  std::deque<OutSample> end();

  [[nodiscard]] bool is_over() const { return over_; }
  [[nodiscard]] bool is_late(const Now& now) const { return !empty() && until_.at() <= now.steady; }
  [[nodiscard]] bool empty() const { return samples_.empty(); }
  // When the oldest was taken, for whatever link.
  [[nodiscard]] TimePoint since() const { return since_; }
  [[nodiscard]] const std::deque<OutSample>& samples() const { return samples_; }

 private:
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
