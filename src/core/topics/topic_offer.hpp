// One local topic on one link.
// One unit: demand, limits and the queue of the channel decide together about each sample.
#pragma once

#include <deque>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/flow/channel_queue.hpp"
#include "core/flow/held_back.hpp"
#include "core/flow/rate_limit.hpp"
#include "core/jobs/encoder.hpp"
#include "core/link/link.hpp"
#include "core/offers/link_offer.hpp"
#include "core/policy/treatment.hpp"
#include "core/ports/status.hpp"
#include "core/topics/early_samples.hpp"
#include "core/topics/export_context.hpp"

namespace connect_bridge {

// Knows whether the topic is offered on the link (LinkOffer) and whether the peer demands it, and
// is the last step of a sample before the link's queue. An offer that is not open stays closed
// until it is reviewed.
class TopicOffer final : public OutgoingChannel {
 public:
  TopicOffer(ExportContext& context, LocalTopic& topic, Link& link);
  TopicOffer(const TopicOffer&) = delete;
  TopicOffer& operator=(const TopicOffer&) = delete;

  // Opens a channel for the topic, if the peer may have it.
  [[nodiscard]] std::optional<ChannelOffer> open();
  // To be called when rules, `accepts`, actions or the type's definition have changed. Why it
  // ends: the caller withdraws the offer; nullopt: it stays.
  [[nodiscard]] std::optional<Ending> review();
  // Ends the channel and sends `withdraw`.
  void withdraw(const Ending& why);
  // Sends the origins of the topic that are new, have a name now, or are gone.
  void add_origins(const std::vector<Gid>& added);
  void remove_origins(const std::vector<OriginId>& removed);

  void on_demand(const ChannelDemand& demand, const Now& now) override;
  void on_decline(const Decline& decline, const Now& now) override;

  // ---- over connections
  // Whether the topic may be resumed, and whether the peer asked for it.
  [[nodiscard]] bool may_resume() const;
  [[nodiscard]] bool resumes() const { return resume_ && demanded(); }
  // Takes what may not have arrived on the lost connection.
  [[nodiscard]] Outbox::Unarrived take_unarrived() {
    return link_.sending().take_unarrived(number());
  }
  [[nodiscard]] Backlog::Options backlog_options(std::uint32_t last_sequence) const;
  // Whether this offer has the same treatment as the former one, so that it can take its place.
  [[nodiscard]] bool may_take_place_of(const Backlog& backlog) const;
  // Sends the messages that were kept and have not arrived.
  void go_on(Outbox::Unarrived kept, const Now& now);
  // Whether the removal of the origin must wait: the peer forgets the origin's base with it.
  [[nodiscard]] bool holds(OriginId origin) const;
  [[nodiscard]] static OutMessage message_of(const OutSample& sample, Codec codec,
                                             const Payload& body);

  // Rate limits do not apply to a sample that its publisher had kept for late subscribers, nor to
  // the first sample of a publisher that keeps its samples: it may be the only one ever published.
  // That one is old for a peer that drives only if it is older than its demand.
  enum class Age : std::uint8_t { kNew, kKept, kFirst };
  // Whether a sample goes to this peer; a drop because of a limit is counted.
  // A sample that a rate limit refuses may leave later (take_held).
  [[nodiscard]] bool admit(const OutSample& sample, Age age, const Now& now);
  // The next sample that waited because of a rate and may leave now.
  [[nodiscard]] std::optional<OutSample> take_held(const Now& now);
  // Adds the samples that still wait because of a rate limit.
  void take_all_held(std::vector<OutSample>& samples);
  void drop_held(DropReason reason);
  void send(const OutSample& sample, Codec codec, const Payload& body, const Now& now);
  void drop(DropReason reason, std::uint64_t count = 1) { dropped_.add(reason, count); }
  // As drop(), for a sample that was admitted: what was to leave together with it waits no longer.
  void lose(const OutSample& sample, DropReason reason);

  // Of a peer that listens: whether it may not yet have had time to demand what it was offered.
  [[nodiscard]] bool is_awaited() const { return is_open() && !demanded() && !early_.is_over(); }
  // Keeps the sample for the peer's demand, see EarlySamples.
  void keep_early(const OutSample& sample, TimePoint since, const Now& now);
  // The peer has said whether it wants the topic.
  std::deque<OutSample> take_early() { return early_.end(); }
  // Drops the samples that were kept for the peer's demand if their time is over. True if it is.
  [[nodiscard]] bool drop_late(const Now& now) {
    if (!early_.is_late(now)) return false;
    drop(DropReason::kNoDemand, early_.end().size());
    return true;
  }
  [[nodiscard]] const EarlySamples& early() const { return early_; }

  [[nodiscard]] bool is_declined() const { return offer_.is_declined(); }
  [[nodiscard]] bool is_open() const { return offer_.is_open(); }
  [[nodiscard]] Link& link() const { return link_; }
  [[nodiscard]] bool demanded() const { return demand_ != 0; }
  // Nothing that was published before the demand goes to this peer: it drives, as the peer says or
  // the rule here.
  [[nodiscard]] bool is_live() const;
  [[nodiscard]] const Treatment& treatment() const { return offer_.treatment(); }
  [[nodiscard]] Keep keep() const { return keep_.keep; }
  // Estimated bytes per second that the path carries; 0: not known.
  [[nodiscard]] double path_rate() const {
    return link_.open() ? link_.outbox().assumed_rate() : 0;
  }
  // How long the path needs for what waits in the link's queue, in seconds; 0: not known.
  [[nodiscard]] double queue_seconds() const;
  // Nothing waits here or in the link's queue.
  [[nodiscard]] bool drained() const;
  void add_status(LinkStatus& status) const;
  void add_channel(std::vector<ChannelFacts>& channels) const;

 private:
  [[nodiscard]] ChannelId number() const { return offer_.number(); }
  [[nodiscard]] bool is_withheld(const Origin& origin) const;
  [[nodiscard]] bool permits(const Payload& sample) const;
  [[nodiscard]] std::set<OriginId> withheld() const;
  [[nodiscard]] OriginOffer offer_of(const Gid& gid, const Origin& origin) const;
  void configure_queue();
  void tell_late();
  // The stamp, node and namespace by which messages of the link leave together.
  [[nodiscard]] Moment moment_of(const OutSample& sample) const;

  ExportContext& context_;
  LocalTopic& topic_;
  Link& link_;
  LinkOffer offer_;
  const bool parameter_events_;    // each origin, and each message, has a right of its own
  ChannelQueue* queue_ = nullptr;  // that of the channel, and null without it
  std::string type_hash_;          // as it was offered
  std::uint16_t demand_ = 0;       // the number that the peer gave it; 0: none
  bool resume_ = false;            // whether it asks to keep what a lost connection loses
  bool live_ = false;              // whether it wants nothing that was published before
  Stamp demanded_at_ = 0;          // the last time
  bool told_late_ = false;
  KeepDecision keep_;
  Company company_ = Company::kNone;
  std::uint64_t namespace_ = 0;  // company_namespace()
  RateLimits rates_;
  EarlySamples early_;
  HeldBack<OutSample, LocalTopic*> held_;
  std::set<OriginId> withheld_;  // only of /parameter_events: of nodes that no rule opens
  std::uint64_t raw_bytes_ = 0;
  DropCounts dropped_;  // before the link's queue
};

}  // namespace connect_bridge
