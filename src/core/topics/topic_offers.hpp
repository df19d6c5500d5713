// The offers of one topic, and the paths of its samples to their links.
// One unit: a sample has one form for several links, and none may overtake another one.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "core/flow/compression_gain.hpp"
#include "core/jobs/encoder.hpp"
#include "core/topics/export_context.hpp"
#include "core/topics/topic_offer.hpp"
#include "core/topics/topic_qos.hpp"

namespace connect_bridge {

// All links to which a topic is offered, and the compression of its samples for them. A sample is
// compressed once for all links that want it in the same form, and each link gets its samples in
// order. Gain and cost are measured, for links that want compression only if it pays.
// Single-threaded.
class TopicOffers {
 public:
  // `context` outlives this object.
  TopicOffers(ExportContext& context, TopicTimers timers) : context_(context), timers_(timers) {}

  // Adds an offer. The link must have none.
  TopicOffer& add(LocalTopic& topic, Link& link) {
    return offers_.try_emplace(link.id, context_, topic, link).first->second;
  }
  // Erases the link's offer, and drops its samples that are being compressed. False: the link had
  // none.
  bool erase(LinkId link);
  // Erases the offers that are not open. False: there were none.
  bool erase_closed();
  void clear();
  // Called when the demand of an offer has changed, or whether the offer keeps early samples.
  void note(TopicOffer& offer);
  // The offers that are demanded or keep early samples. A sample concerns no other offer, so its
  // cost does not depend on the number of links without demand.
  [[nodiscard]] const std::map<LinkId, TopicOffer*>& busy() const { return busy_; }
  // Keeps the sample for these offers: their peers listen and may demand the topic soon.
  void keep_early(const std::vector<TopicOffer*>& awaited, const OutSample& sample, const Now& now);
  // Drops the samples that were kept too long for demands that did not come. False: there were
  // none.
  [[nodiscard]] bool drop_late(const Now& now);

  [[nodiscard]] std::size_t size() const { return offers_.size(); }
  [[nodiscard]] bool contains(LinkId link) const { return offers_.contains(link); }
  [[nodiscard]] auto find(LinkId link) { return offers_.find(link); }
  [[nodiscard]] auto find(LinkId link) const { return offers_.find(link); }
  [[nodiscard]] auto begin() { return offers_.begin(); }
  [[nodiscard]] auto begin() const { return offers_.begin(); }
  [[nodiscard]] auto end() { return offers_.end(); }
  [[nodiscard]] auto end() const { return offers_.end(); }

  // The topic's subscription is made with this QoS.
  void on_subscribed(const Qos& qos) { qos_ = qos; }
  // Sends the sample to all links whose offers admit it. send_to(): sends it to this link, whose
  // offer has admitted it.
  void send(const OutSample& sample, TopicOffer::Age age, const Now& now);
  void send_to(TopicOffer& offer, const OutSample& sample, const Now& now);
  // The compression of a sample of this size for the link. Without a codec the sample is sent at
  // once, uncompressed.
  [[nodiscard]] Compression way_to(TopicOffer& offer, std::size_t bytes, const Now& now);
  // Sends the sample to its targets when it is compressed. Its targets are links for which way_to()
  // returned `how`.
  void encode(const Compression& how, OutSample sample, const Now& now);
  // Counts lost samples at all links that demand the topic.
  void drop(DropReason reason, std::uint64_t count);
  // A deadline of the topic has come. `held`: samples that rates have held and that may leave now.
  void on_time(std::size_t& held, const Now& now);
  // Takes the samples that are being compressed for the link, in order; the link will not get them.
  std::vector<OutSample> take_under_way(LinkId link);
  // Drops these samples, because the demand has ended.
  void lose_under_way(TopicOffer& offer, DropReason reason);
  // Drops all samples that are being compressed.
  void drop_under_way();

  [[nodiscard]] bool demanded() const;
  // True if no peer that wants the topic, or may come to want it, wants samples that publishers
  // keep.
  [[nodiscard]] bool want_live(const TopicKey& topic) const;
  // Does a sample of the origin wait for a link?
  [[nodiscard]] bool hold(OriginId origin) const;
  // No sample waits for any link.
  [[nodiscard]] bool drained() const;
  // Bytes of samples that are being compressed.
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  // The samples of the topic that are compressed in one form.
  struct Stream final : JobOwner {
    Stream(TopicOffers& of, Encoder::Options options)
        : offers(of),
          automatic(options.how.automatic),
          passes(automatic && !options.how.loses()),
          encoder(options, of.context_.jobs, *this) {}
    void on_job(std::optional<Payload> result, const Now& now) override;

    TopicOffers& offers;
    bool automatic;
    bool passes;  // a sample may leave uncompressed instead
    Encoder encoder;
    bool measured = false;      // `gain` knows
    ExportTimers::Timer later;  // the next sample is not needed before then
    TimePoint begun{};          // the job under way
    bool chosen = false;        // the first waiting sample is to be compressed, not only in line
    CompressionGain gain;
    double seconds_per_byte = 10e-9;  // to compress and decompress; a guess before the first
  };
  Stream& stream_of(const Compression& how);
  // The way of a large sample where the rule leaves it open, for a path with this rate.
  [[nodiscard]] Compression automatic_way(const TopicOffer& offer, double rate) const;
  // Does the sample leave as a picture, because too few exact ones would?
  [[nodiscard]] bool becomes_picture(TopicOffer& offer, const OutSample& sample, const Now& now);
  // What of clouds the link does without.
  void choose_step(TopicOffer& offer, std::size_t bytes, const Now& now);
  [[nodiscard]] bool may_be_lossy(const TopicOffer& offer) const {
    const bool cloud = is_cloud(offer.type()) && offer.decodes().cloud;
    return cloud && offer.may_lose() && !offer.is_latched();  // mutant: lossy_latched
  }
  // Drops what waits for the link in a form that is no longer wanted, or with a worker in one that
  // is no longer allowed; newer samples come.
  [[nodiscard]] bool leave(Stream& stream, const Compression& how, TopicOffer& offer);
  void send_encoded(Stream& stream, const Now& now);
  void send(const Encoder::Encoded& ready, const Now& now);
  // Has the stream's next sample only waited for earlier ones, and is it better sent uncompressed?
  [[nodiscard]] bool passes(const Stream& stream) const;
  // Time that compressing the stream's next sample can wait.
  [[nodiscard]] Duration slack_of(const Stream& stream) const;
  void drop(const OutSample& sample, DropReason reason);

  ExportContext& context_;
  TopicTimers timers_;
  Qos qos_;
  std::map<LinkId, TopicOffer> offers_;
  std::map<LinkId, TopicOffer*> busy_;
  std::map<Compression, Stream> streams_;
};

}  // namespace connect_bridge
