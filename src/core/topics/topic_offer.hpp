// One local topic on one link.
// One unit: demand, limits and the queue of the channel decide together about each sample.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/flow/channel_queue.hpp"
#include "core/flow/held_back.hpp"
#include "core/flow/pulse.hpp"
#include "core/flow/rate_limit.hpp"
#include "core/jobs/encoder.hpp"
#include "core/link/link.hpp"
#include "core/offers/link_offer.hpp"
#include "core/policy/treatment.hpp"
#include "core/ports/status.hpp"
#include "core/topics/cloud_form.hpp"
#include "core/topics/early_samples.hpp"
#include "core/topics/export_context.hpp"
#include "core/topics/picture_stream.hpp"

namespace connect_bridge {

// Knows whether the topic is offered on the link (LinkOffer), and whether the peer demands it. The
// last step of a sample before the link's queue. An offer that is not open stays closed until it is
// reviewed.
class TopicOffer final : public OutgoingChannel {
 public:
  TopicOffer(ExportContext& context, LocalTopic& topic, Link& link);
  TopicOffer(const TopicOffer&) = delete;
  TopicOffer& operator=(const TopicOffer&) = delete;

  // Opens a channel for the topic, if the peer may have it.
  [[nodiscard]] std::optional<ChannelOffer> open();
  // Called when rules, `accepts`, actions or the type's definition have changed. Applies keys that
  // need no other offer. Returns why the offer ends, and the caller withdraws it; nullopt: the
  // offer stays.
  [[nodiscard]] std::optional<Ending> review();
  // Ends the channel and sends `withdraw`.
  void withdraw(const Ending& why);
  // Sends the origins of the topic that are new or have got a name since the peer was told last,
  // and (below) those that are gone. Returns the number of changes.
  std::size_t tell_origins();
  void remove_origins(const std::vector<OriginId>& removed);

  void on_demand(const ChannelDemand& demand, const Now& now) override;
  void on_decline(const Decline& decline, const Now& now) override;
  void on_left(const Now& now) override { pictures_.on_left(now); }
  void on_wheel(WheelState state, const Now&) override;
  // Commands of a driver that the peer subscribes to: if it is the robot, it may have their wheel.
  [[nodiscard]] bool steers() const;
  // The robot's last word about the wheel.
  [[nodiscard]] const std::optional<WheelState>& wheel() const { return wheel_; }
  void want_wheel(WheelWant want) { link_.send(Wheel{number(), {}, want}); }

  // May the topic be resumed? resumes(): the peer has requested that, too.
  [[nodiscard]] bool may_resume() const;
  [[nodiscard]] bool resumes() const { return resume_ && demanded(); }
  // Takes the messages that may not have arrived on the lost connection.
  [[nodiscard]] Outbox::Unarrived take_unarrived() {
    return link_.sending().take_unarrived(number());
  }
  [[nodiscard]] Backlog::Options backlog_options(std::uint32_t last_sequence) const;
  // Can this offer take the place of the former one? Its type must be the same, and its treatment
  // but for keys that are followed.
  [[nodiscard]] bool may_take_place_of(const Backlog& backlog) const;
  // Sends the kept messages that have not arrived.
  void go_on(Outbox::Unarrived kept, const Now& now);
  // Must the removal of the origin wait? The peer would forget the origin's base with it.
  [[nodiscard]] bool holds(OriginId origin) const;
  [[nodiscard]] static OutMessage message_of(const OutSample& sample, Codec codec,
                                             const Payload& body);

  // The age of a sample. Rate limits do not apply to a sample that its publisher had kept for late
  // subscribers. Nor do they apply to the first sample of a publisher that keeps its samples, which
  // may be the only one ever. For a peer that drives, a first sample is old only if it is older
  // than the demand.
  enum class Age : std::uint8_t { kNew, kKept, kFirst };
  // Decides whether a sample goes to this peer, and counts a drop because of a limit. A sample that
  // a rate limit refuses may leave later (take_held).
  [[nodiscard]] bool admit(const OutSample& sample, Age age, const Now& now);
  // The next sample that waited because of a rate and may leave now.
  [[nodiscard]] std::optional<OutSample> take_held(std::size_t& left, const Now& now);
  // Moves the samples that still wait because of a rate limit to `samples`.
  void take_all_held(std::vector<OutSample>& samples);
  void drop_held(DropReason reason);
  // Drops the samples that were kept for the peer's demand, and keeps no more.
  void drop_early(DropReason reason);
  void send(const OutSample& sample, Codec codec, const Payload& body, const Now& now);
  void drop(DropReason reason, std::uint64_t count = 1) { dropped_.add(reason, count); }
  // Drops an admitted sample, and releases the messages that waited to leave with it.
  void lose(const OutSample& sample, DropReason reason);

  // May a listening peer still need time to demand the offered topic?
  [[nodiscard]] bool is_awaited() const { return is_open() && !demanded() && !early_.is_over(); }
  // Keeps the sample until the peer demands the topic, see EarlySamples.
  void keep_early(const OutSample& sample, TimePoint since, const Now& now);
  // The peer has demanded or declined the topic: returns the samples kept for that.
  std::deque<OutSample> take_early() { return early_.end(); }
  // Drops the samples that were kept for the peer's demand, if their time is over. True if it is.
  [[nodiscard]] bool drop_late(const Now& now) {
    if (!early_.is_late(now)) return false;
    drop(DropReason::kNoDemand, early_.end().size());
    return true;
  }
  [[nodiscard]] const EarlySamples& early() const { return early_; }

  [[nodiscard]] bool is_declined() const { return offer_.is_declined(); }
  [[nodiscard]] bool is_open() const { return offer_.is_open(); }
  [[nodiscard]] Link& link() const { return link_; }
  [[nodiscard]] bool demanded() const { return demand_.number != 0; }
  // The forms of a message that the peer decodes, and whether they need not be exact; none without
  // a demand.
  [[nodiscard]] const Decodes& decodes() const { return demand_.decodes; }
  [[nodiscard]] bool may_be_lossy() const { return demand_.lossy; }
  // The same by both ends' rules.
  [[nodiscard]] bool may_lose() const { return demand_.lossy && rule_may_lose(); }
  // Does a publisher keep samples for late subscribers? Then all samples of the topic are exact:
  // beside volatile publishers the subscription is volatile, too.
  [[nodiscard]] bool is_latched() const;
  [[nodiscard]] const std::string& name() const;
  [[nodiscard]] const std::string& type() const;
  // How exact a cloud is for this peer.
  [[nodiscard]] CloudForm& cloud() { return cloud_; }
  [[nodiscard]] const CloudForm& cloud() const { return cloud_; }
  // The pictures for this peer, where exact ones do not fit; begin_pictures(): from now on.
  [[nodiscard]] PictureStream& pictures() { return pictures_; }
  [[nodiscard]] const PictureStream& pictures() const { return pictures_; }
  void begin_pictures();
  [[nodiscard]] bool has_one_origin() const;
  // May the sample be sent as a picture of a camera: by rules, demand, publisher and content?
  [[nodiscard]] bool may_be_picture(const OutSample& sample) const;
  // True for a peer that drives, by its own demand or our rule: messages published before the
  // demand do not go to it.
  [[nodiscard]] bool is_live() const;
  [[nodiscard]] const Treatment& treatment() const { return offer_.treatment(); }
  [[nodiscard]] Keep keep() const { return keep_.keep; }
  // Estimated bytes per second that the path carries; 0: unknown.
  [[nodiscard]] double path_rate() const {
    return link_.open() ? link_.outbox().assumed_rate() : 0;
  }
  // The part of it that this channel gets, if its messages show it; else all of it.
  struct Rate {
    double rate = 0;  // bytes per second; 0: not known
    bool is_shown = false;
    bool is_near = false;  // less has shown it, but not so that it would be wrong by times
  };
  [[nodiscard]] Rate channel_rate(const Now& now) const;
  // The queue of the channel; null without a channel.
  [[nodiscard]] const ChannelQueue* queue() const { return queue_; }
  // Time that the path needs for the messages in the link's queue, in seconds; 0: unknown.
  [[nodiscard]] double queue_seconds() const;
  // No message waits here or in the link's queue.
  [[nodiscard]] bool drained() const;
  void add_status(LinkStatus& status) const;
  // The link keeps the counts of the topic, if it has any: the channel ends. `of_queued`: why
  // messages that wait do not arrive.
  void leave_counts(DropReason of_queued = DropReason::kLinkLost) const;
  void add_channel(std::vector<ChannelFacts>& channels) const;

 private:
  [[nodiscard]] ChannelId number() const { return offer_.number(); }
  [[nodiscard]] bool rule_may_lose() const {
    return keep() == Keep::kNewest && treatment().compression.automatic &&
           treatment().lossy != Lossy::kNever && treatment().resume != true;
  }
  // Does the sample's publisher also publish a CameraInfo, where image_transport has it?
  [[nodiscard]] bool has_camera_info(const OutSample& sample) const;
  [[nodiscard]] bool is_withheld(const Origin& origin) const;
  // Was the peer told of the origin, or is it to know nothing of it?
  [[nodiscard]] bool is_told(OriginId origin) const { return origin.value <= newest_told_.value; }
  void note_told();
  [[nodiscard]] bool permits(const Payload& sample) const;
  // Has the peer published this sample already? Its demand says so.
  [[nodiscard]] bool is_there(const OutSample& sample) const;
  [[nodiscard]] std::set<OriginId> withheld() const;
  [[nodiscard]] OriginOffer offer_of(const Gid& gid, const Origin& origin) const;
  void send_change(const OriginsChanged& change);
  void configure_queue();
  // The rules have other keys than `before`, and the offer stays.
  void follow(const Treatment& before);
  void follow_rates();
  // May the message, made for an earlier demand, answer this one?
  [[nodiscard]] bool is_answer(const OutMessage& message) const;
  void tell_late();
  void tell_overload(Codec codec, const Now& now);
  // Counts a message beyond the peer's limit, and tells the peer from time to time.
  void tell_too_large(std::size_t bytes, const Now& now);
  // Notes the form of the sample for the status; says once that points are rounded or left out.
  void note_form(Codec codec, std::size_t raw_bytes, const Payload& body);
  // The stamp, node and namespace by which messages of the link leave together.
  [[nodiscard]] Moment moment_of(const OutSample& sample) const;

  ExportContext& context_;
  LocalTopic& topic_;
  Link& link_;
  LinkOffer offer_;
  const bool parameter_events_;    // each origin, and each message, has its own right
  ChannelQueue* queue_ = nullptr;  // the queue of the channel; null without a channel
  std::string type_hash_;          // as offered
  std::uint64_t change_told_ = 0;  // of the origins: the last one
  OriginId newest_told_;           // origin
  ChannelDemand demand_;           // the peer's; number 0: none
  bool resume_ = false;            // the demand requests messages that a lost connection loses
  Stamp demanded_at_ = 0;          // time of the last change of the demand
  bool late_logged_ = false;
  bool overload_logged_ = false;
  std::uint64_t too_large_ = 0;  // of this channel, for the peer
  std::optional<TimePoint> too_large_sent_;
  CloudForm cloud_;
  PictureStream pictures_;
  SentAs sent_as_;
  KeepDecision keep_;
  Company company_ = Company::kNone;
  std::uint64_t namespace_ = 0;  // company_namespace()
  RateLimits rates_;
  Pulse pulse_;
  EarlySamples early_;
  HeldBack<OutSample, LocalTopic*> held_;
  std::set<OriginId> withheld_;  // only for /parameter_events: origins of nodes that no rule opens
  std::uint64_t raw_bytes_ = 0;
  std::optional<WheelState> wheel_;  // as the robot has told
  DropCounts dropped_;               // before the link's queue
};

}  // namespace connect_bridge
