// Compresses the samples of one exported topic in order: once per sample, whatever the number of
// links.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <vector>

#include "core/base/bytes.hpp"
#include "core/base/ids.hpp"
#include "core/ports/inputs.hpp"
#include "core/ports/outputs.hpp"
#include "core/wire/codec.hpp"

namespace connect_bridge {

// One sample on its way from ROS to the links that want it.
struct OutSample {
  OriginId origin;
  Stamp stamp = 0;
  Payload raw;
  std::vector<LinkId> targets;
};

// Small samples are compressed at once, large ones by a worker, one at a time, so that order is
// kept. While the worker is busy samples wait; beyond depth or bytes the oldest waiting one is
// dropped.
class Encoder {
 public:
  struct Options {
    Compression how;
    std::uint32_t job_bytes = 0;        // from this size on a worker does it
    std::uint32_t depth = 0;            // samples that may wait; 0: no limit but bytes
    std::uint64_t queue_bytes_max = 0;  // one sample always fits
  };
  using Deliver = std::function<void(const OutSample&, Codec, const Payload& body)>;
  using Drop = std::function<void(const OutSample&)>;

  explicit Encoder(Options options) : options_(options) {}

  void push(OutSample sample, Outputs& outputs, const Deliver& deliver, const Drop& drop);
  // False: not a job of this encoder.
  bool on_job(const JobDone& done, Outputs& outputs, const Deliver& deliver);
  // Forgets everything, as dropped.
  void clear(const Drop& drop);
  // The job under way, if any.
  [[nodiscard]] JobId job() const { return busy_ ? job_ : JobId{}; }
  [[nodiscard]] std::uint64_t bytes() const {
    return waiting_bytes_ + (busy_ ? busy_->raw.size() : 0);
  }

 private:
  void encode(OutSample sample, Outputs& outputs, const Deliver& deliver);

  Options options_;
  std::deque<OutSample> waiting_;
  std::uint64_t waiting_bytes_ = 0;
  std::optional<OutSample> busy_;
  JobId job_;
};

}  // namespace connect_bridge
