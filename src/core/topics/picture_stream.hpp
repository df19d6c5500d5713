// The pictures of one topic on one link, each encoded at the last moment.
// One unit: a picture refers to the one before, so what waits, is encoded and leaves changes
// together.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>

#include "core/jobs/encoder.hpp"
#include "core/jobs/jobs.hpp"
#include "core/topics/exact_fit.hpp"
#include "core/topics/export_context.hpp"

namespace connect_bridge {

class TopicOffer;

// The newest sample waits until the link has nearly sent the picture before. Then a worker encodes
// it, as large as the link carries until the next sample comes. So no picture is made that does not
// leave, and what arrives is as new as it can be. A picture that was made is never replaced; if the
// queue drops one for its own limits, the next picture refers to nothing. Belongs to one offer;
// single-threaded.
class PictureStream final : private JobOwner {
 public:
  // All outlive this object.
  PictureStream(TopicOffer& offer, ExportContext& context, TopicTimers timers)
      : offer_(offer), context_(context), timers_(timers) {}
  PictureStream(const PictureStream&) = delete;
  PictureStream& operator=(const PictureStream&) = delete;

  // Whether exact samples fit the link instead.
  [[nodiscard]] ExactFit& fit() { return fit_; }
  [[nodiscard]] const ExactFit& fit() const { return fit_; }

  // The sample is the newest of its origin; the one that waits is lost (kNewerAvailable).
  void push(OutSample sample, const Now& now);
  // The last part of a picture was handed out.
  void on_left(const Now& now);
  // A deadline of the topic has come.
  void on_time(const Now& now);
  // Loses what waits or is with the worker. The next picture of each origin refers to nothing.
  void clear(DropReason reason);
  // The same for one origin; end(): it is gone.
  void forget(OriginId origin, DropReason reason);
  void end(OriginId origin);

  // Neither has the memory refused a sample of the origin since clear(), nor the worker several.
  [[nodiscard]] bool takes(OriginId origin) const;
  // No sample waits or is with the worker; of this origin, or of any.
  [[nodiscard]] bool holds(OriginId origin) const;
  [[nodiscard]] bool empty() const { return bytes() == 0; }
  // Samples that wait or are with the worker, and (below) their bytes.
  [[nodiscard]] std::size_t size() const;
  [[nodiscard]] std::uint64_t bytes() const;
  // Bytes per second that the channel's last pictures had; 0: none has left.
  [[nodiscard]] double rate(const Now& now) const;

 private:
  struct Source {
    Source(Jobs& jobs, Budget& memory) : pictures(jobs, memory) {}
    Jobs::Pictures pictures;
    std::optional<OutSample> newest;
    bool base_due = true;
    std::uint64_t turn = 0;  // its last
  };
  struct Leaving {
    std::uint64_t bytes = 0;
    TimePoint since{};
  };
  struct Sent {
    double bytes = 0;
    double seconds = 0;
  };

  void on_job(std::optional<Payload> result, const Now& now) override;
  // Begins with the next sample, or sets the time for that.
  void go(const Now& now);
  void begin(Source& source, const Now& now);
  // The origin whose turn was longest ago, of those with a sample; end(): none.
  [[nodiscard]] std::map<OriginId, Source>::iterator next_source();
  // The queue has dropped messages since the last call: pictures refer to nothing from now on.
  bool note_drops();
  // When the link was free for the picture that leaves now.
  [[nodiscard]] TimePoint leaving_since() const;
  void cancel_job(DropReason reason);

  TopicOffer& offer_;
  ExportContext& context_;
  TopicTimers timers_;
  ExactFit fit_;
  std::map<OriginId, Source> sources_;
  std::map<OriginId, int> refused_;  // samples in a row
  struct AtWork {
    OutSample sample;
    TimePoint since{};
  };
  std::optional<AtWork> at_work_;
  Jobs::Job job_;
  ExportTimers::Timer later_;
  double seconds_ = 0.01;  // a picture takes at the worker; a guess before the first
  std::uint64_t turns_ = 0;
  std::uint64_t drops_ = 0;      // of the queue, as known
  std::deque<Leaving> leaving_;  // in the queue, in order
  TimePoint left_at_{};          // the last one
  std::deque<Sent> sent_;        // the last ones
};

}  // namespace connect_bridge
