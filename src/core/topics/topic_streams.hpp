// How the samples of one topic are compressed before they are queued.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "core/flow/compression_gain.hpp"
#include "core/jobs/encoder.hpp"
#include "core/topics/export_context.hpp"
#include "core/topics/topic_offer.hpp"

namespace connect_bridge {

// Belongs to an exported topic. A sample is compressed once for all links that want it in the same
// way, and each link gets its samples in order. Gain and cost are measured, for links that want
// compression only where it pays. Single-threaded.
class TopicStreams {
 public:
  using Offers = std::map<LinkId, TopicOffer>;

  // All outlive this; `qos`: of the topic's subscription.
  TopicStreams(ExportContext& context, ExportedTopic& topic, Offers& offers, const Qos& qos)
      : context_(context), topic_(topic), offers_(offers), qos_(qos) {}

  // How a sample of this size is compressed for the link; without a codec: it is sent at once,
  // uncompressed.
  [[nodiscard]] Compression way_to(const TopicOffer& offer, LinkId link, std::size_t bytes);
  // Sends the sample to its targets when it is compressed; they are links for which way_to()
  // returned `how`.
  void encode(const Compression& how, OutSample sample, const Now& now);
  // A deadline of the topic has come.
  void on_time(const Now& now);
  // Takes the samples for the link that are under way, in order; it will not get them.
  std::vector<OutSample> forget(LinkId link);
  // Drops all that is under way.
  void clear();
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  // The samples of the topic that are compressed in one way.
  struct Stream final : JobOwner {
    Stream(TopicStreams& of, Encoder::Options options)
        : streams(of),
          automatic(options.how.automatic),
          encoder(options, of.context_.jobs, *this) {}
    void on_job(std::optional<Payload> result, const Now& now) override;

    TopicStreams& streams;
    bool automatic;
    Encoder encoder;
    ExportTimers::Timer later;  // the next sample is not needed before then
    TimePoint begun{};          // the job under way
    bool chosen = false;        // the first waiting one is to be compressed, not only in line
    CompressionGain gain;
    double seconds_per_byte = 10e-9;  // to compress and decompress; a guess before the first
  };
  Stream& stream_of(const Compression& how);
  void send_encoded(Stream& stream, const Now& now);
  void send(const Encoder::Encoded& ready, const Now& now);
  // Whether the stream's next sample only waited for earlier ones, and is better sent uncompressed.
  [[nodiscard]] bool passes(const Stream& stream) const;
  // How long compressing the stream's next sample can wait.
  [[nodiscard]] Duration slack_of(const Stream& stream) const;
  void drop(const OutSample& sample, DropReason reason);

  ExportContext& context_;
  ExportedTopic& topic_;
  Offers& offers_;
  const Qos& qos_;
  std::map<Compression, Stream> streams_;
};

}  // namespace connect_bridge
