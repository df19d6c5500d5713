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

// The newest samples of a topic that are kept for one link until its peer demands the topic. A peer
// that listens will demand it, but a new publisher's first messages are taken before the offer has
// arrived there and the demand has come back. They are kept for at most two seconds after the
// first. Single-threaded.
class EarlySamples {
 public:
  explicit EarlySamples(TopicTimers timers) : timers_(timers) {}

  // Keeps the sample. `since`: when the first early sample of the topic was taken; `all`: the
  // budget of the early samples of all topics; `account`: that of the link. Returns how many
  // samples had to be dropped (this one or the oldest ones), and why.
  struct Dropped {
    DropReason reason;
    std::size_t count;
  };
  [[nodiscard]] Dropped add(const OutSample& sample, TimePoint since, Budget& all,
                            const std::shared_ptr<Account>& account, const Now& now);
  // The peer has said whether it wants the topic, or the time for that is over: no more samples are
  // kept. Returns those that were.
  std::deque<OutSample> end();

  [[nodiscard]] bool is_over() const { return over_; }
  [[nodiscard]] bool is_late(const Now& now) const { return !empty() && until_.at() <= now.steady; }
  [[nodiscard]] bool empty() const { return samples_.empty(); }
  // When the topic's oldest early sample was taken, also if it was for another link.
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
