// Compresses messages in order: once per message, whatever the number of links that want it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "core/base/bytes.hpp"
#include "core/base/ids.hpp"
#include "core/flow/drops.hpp"
#include "core/flow/out_message.hpp"
#include "core/jobs/jobs.hpp"
#include "core/wire/codec.hpp"

namespace connect_bridge {

// One sample on its way from ROS to the links that want it.
struct OutSample {
  Subject subject;
  Stamp stamp = 0;
  std::uint64_t number = 0;  // as in MessageFrame
  Payload raw;
  std::vector<LinkId> targets;
  bool reliable = false;                    // it may be kept for a link that is lost
  std::optional<std::uint64_t> state = {};  // as in OutMessage
  Stamp header = 0;                         // of the Header with which it begins; 0: none
  std::uint64_t node = 0;                   // company_node() of its publisher
  TimePoint taken{};
  std::uint64_t order = 0;  // as in OutMessage, and those below
  VideoPart video = VideoPart::kNone;
  std::uint64_t camera = 0;

  // The state whose rate counts it (RateLimit).
  [[nodiscard]] std::uint64_t rate_state() const {
    return video == VideoPart::kNone ? state.value_or(0) : camera;
  }
};

// Small samples are compressed at once, large ones by a worker, one at a time, so that order is
// kept. While the worker is busy samples wait; beyond depth or bytes the oldest waiting one is
// dropped. After push() and after finish() call next() until it returns nothing.
class Encoder {
 public:
  struct Options {
    Compression how;
    std::uint32_t depth = 0;            // samples that may wait; 0: no limit but bytes
    std::uint64_t queue_bytes_max = 0;  // one sample always fits
  };
  struct Encoded {
    OutSample sample;
    Codec codec = Codec::kNone;  // kNone: it does not shrink, the body is the sample
    Payload body;
  };

  // `owner` receives the worker's result and passes it to finish().
  Encoder(Options options, Jobs& jobs, JobOwner& owner)
      : options_(options), jobs_(jobs), owner_(owner) {}

  struct Displaced {
    OutSample sample;
    DropReason reason;
  };

  // Returns the samples that were dropped: to make room, or because they have waited for long and
  // this one tells the same state.
  [[nodiscard]] std::vector<Displaced> push(OutSample sample);
  // The result of the job under way.
  void finish(std::optional<Payload> result);
  // The next sample, once it is ready.
  [[nodiscard]] std::optional<Encoded> next();
  // Takes the sample of upcoming(), which must not be null, uncompressed.
  [[nodiscard]] Encoded pass();
  // The link gets none of the samples under way any more; returns those that were for it, in order.
  std::vector<OutSample> forget(LinkId link);
  // Whether a sample under way is for the link; works_for(): whether a worker has it.
  [[nodiscard]] bool holds(LinkId link) const;
  [[nodiscard]] bool works_for(LinkId link) const {
    return at_work_ && std::find(at_work_->targets.begin(), at_work_->targets.end(), link) !=
                           at_work_->targets.end();
  }
  // Forgets everything; all these samples are dropped.
  std::vector<OutSample> clear();

  [[nodiscard]] std::uint64_t bytes() const {
    return waiting_bytes_ + (at_work_ ? at_work_->raw.size() : 0);
  }

  // The sample with which next() would begin; null: nothing waits, or a worker is busy with an
  // earlier one.
  [[nodiscard]] const OutSample* upcoming() const {
    return at_work_ || finished_ || waiting_.empty() ? nullptr : &waiting_.front();
  }
  // Size of the sample that a worker compresses now; 0: none.
  [[nodiscard]] std::uint64_t bytes_at_work() const { return at_work_ ? at_work_->raw.size() : 0; }

 private:
  Encoded whole(OutSample sample, std::optional<Payload> body) const;
  OutSample take_waiting(std::size_t index = 0);

  Options options_;
  Jobs& jobs_;
  JobOwner& owner_;
  std::deque<OutSample> waiting_;
  std::uint64_t waiting_bytes_ = 0;
  std::optional<OutSample> at_work_;  // with the worker, while job_ is under way
  Jobs::Job job_;
  std::optional<Encoded> finished_;
};

}  // namespace connect_bridge
