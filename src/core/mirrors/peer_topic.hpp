// One topic that a peer offers.
// One unit: messages wait for workers and leave in the channel's order, whatever ends meanwhile.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "core/base/budget.hpp"
#include "core/flow/delta_decoder.hpp"
#include "core/flow/held_back.hpp"
#include "core/flow/pulse.hpp"
#include "core/flow/reassembly.hpp"
#include "core/jobs/jobs.hpp"
#include "core/link/link.hpp"
#include "core/mirrors/import_context.hpp"
#include "core/mirrors/left_out_origins.hpp"
#include "core/mirrors/mirror_wish.hpp"
#include "core/offers/import_right.hpp"
#include "core/policy/interface.hpp"
#include "core/ports/status.hpp"

namespace connect_bridge {

class LinkTopics;

// Demands the topic while one of the mirrors that it feeds wants data. Receives its messages,
// decompresses them in order, and gives them to the mirrors of their origins. While a worker
// decompresses a message, all later messages of the channel wait, even those of other origins and
// those that need no worker. So each origin keeps the order of the channel.
class PeerTopic final : public IncomingChannel, private JobOwner {
 public:
  // `key` has the local name; everything else is as the peer offers it.
  PeerTopic(LinkTopics& peer, TopicKey key, const ChannelOffer& offer, Decision decision);
  PeerTopic(const PeerTopic&) = delete;
  PeerTopic& operator=(const PeerTopic&) = delete;
  ~PeerTopic() override;

  void add_origin(const OriginOffer& origin, const Now& now);
  // Our rules have changed. False: no rule allows the topic any longer.
  [[nodiscard]] bool recheck(const Now& now);
  // Is this /parameter_events, and no rule allows the parameters of the origin's node?
  [[nodiscard]] bool withholds(const OriginOffer& origin) const {
    return parameter_events_ && withholds_events(context_, link_, origin.node);
  }
  // Creates again the mirrors whose rule now requires another QoS.
  void renew(const Now& now);
  // Sends `decline`: the topic is not imported any longer.
  void decline(const Now& now);
  // The connection is about to be lost. Publishes messages that wait for a worker, if the topic
  // resumes, because the peer will not send them again. Messages that must not be late do not wait
  // for their subscribers any longer.
  void finish(const Now& now);
  // The connection is lost: mirrors wait for the link's return.
  void lose(const Now& now);

  // The wishes of the mirrors that this topic feeds.
  [[nodiscard]] MirrorWishes& wishes() { return wishes_; }
  // A mirror may have kept samples for late subscribers.
  void note_kept() { may_keep_ = true; }
  // The wishes of a mirror have changed, or the subscribers here.
  void update_demand(const Now& now);
  // begin_demand() returns the demand to send, under this number. end_demand() drops all messages
  // that still wait here.
  ChannelDemand begin_demand(std::uint16_t number);
  void end_demand();
  // Pauses the demand, so that the exporter sends the last samples again.
  void demand_again(const Now& now);

  // Messages of an ended demand may still arrive when the next one is sent. The next demand begins
  // with the last samples, which are older, so these messages are not wanted.
  [[nodiscard]] bool wants(std::uint16_t demand) const override {
    return demanded_ && demand == demand_;  // mutant: ended_demand
  }
  Result<Nothing> on_message(InMessage message, const Now& now) override;
  Result<Nothing> on_origins(const OriginsChanged& change, const Now& now) override;
  void on_wheel_wanted(WheelWant want, const Now& now) override;
  void on_withdraw(const Withdraw& why, const Now& now) override;

  // Publishes the messages that a rate limit has held back, when their time has come.
  void publish_held(std::size_t& left, const Now& now);
  // The peer's clock is known now: judges the commands that waited for it.
  void publish_unjudged(const Now& now);
  // Tells the peer who steers, if that has changed.
  void tell_wheel(WheelState state);
  // Counts messages as dropped that were counted as published: the mirror has lost them.
  void on_lost(std::uint64_t count, DropReason reason);

  [[nodiscard]] Link& link() const { return link_; }
  [[nodiscard]] ChannelId number() const { return number_; }
  [[nodiscard]] const TopicKey& key() const { return key_; }
  [[nodiscard]] LeftOutOrigins& left_out() { return left_out_; }
  [[nodiscard]] const std::string& type_hash() const { return type_hash_; }
  [[nodiscard]] const std::string& action_type() const { return action_type_; }
  [[nodiscard]] const Treatment& treatment() const { return decision_.treatment; }
  [[nodiscard]] bool demanded() const { return demanded_; }
  void add_status(LinkStatus& status) const;
  // The link keeps the counts of the topic, if it has any: the connection is lost.
  void leave_counts() const;
  void add_channel(std::vector<ChannelFacts>& channels) const;

 private:
  struct Waiting {
    InMessage message;
    Budget::Hold bytes;
    bool published = true;  // else only a later picture refers to it
    TimePoint since{};
  };

  void on_job(std::optional<Payload> result, const Now& now) override;
  // Whether a message is published, or only decoded because later pictures refer to it, or dropped.
  enum class Useful : std::uint8_t { kNo, kForOthers, kYes };
  // Decodes the message so that it needs no base.
  Result<Useful> resolve(InMessage& message, const Now& now);
  // Checks what the body of a picture or cloud says of itself, for the demand and the status.
  Result<Nothing> note_form(const InMessage& message);
  void make_room(const InMessage& message);
  // False: the picture refers to one that was dropped, and is dropped itself.
  [[nodiscard]] bool follows(const InMessage& message);
  // Counts the message as dropped. After a picture the demand begins again, at most once a second:
  // the next one then refers to nothing.
  void drop(const InMessage& message, DropReason reason, const Now& now);
  [[nodiscard]] Jobs::Pictures& pictures_of(const InMessage& message);
  void start_job();
  // Publishes at once the messages that wait for a worker or are held back by a rate limit. `of`:
  // their origin; none: all origins. Messages that cost too much time are dropped. Messages of
  // other origins keep their order.
  void hurry(DropReason otherwise, const Now& now, std::optional<OriginId> of = {});
  // Publishes the messages that waited for a finished job, up to the next job.
  void advance(const Now& now);
  // `was_held`: the rate limit of the publisher had refused the message, and lets it pass now.
  void publish(const MessageHead& message, const Payload& raw, const Now& now,
               bool was_held = false);
  // The sample with the peer's nodes as they are called here.
  [[nodiscard]] Payload with_names_here(const TopicMirror& mirror, const Payload& raw) const;
  // Does the publisher's rate let the message pass? If not, it is held back.
  [[nodiscard]] bool admits(const MessageHead& message, const Payload& raw,
                            const TopicMirror& mirror, const Now& now);
  // How long a message may be under way.
  [[nodiscard]] Duration age_limit() const {
    const Treatment& rule = treatment();
    if (command_ && rule.max_age == kForever) return rule.halt_after;
    return rule.max_age;
  }
  // A command that moves came before the peer's clock was known: true. The newest one of its
  // publisher waits.
  [[nodiscard]] bool waits_for_clock(const MessageHead& message, const Payload& raw, bool moves,
                                     const Now& now);
  // May the message be published by its age? `age`: gets it, if it is known.
  [[nodiscard]] bool is_fresh(const MessageHead& message, bool moves, TopicMirror& mirror,
                              Duration& age, const Now& now);
  // The peer has dropped so many messages of this channel because of our limit.
  void on_too_large(std::uint64_t messages, std::uint64_t bytes);
  // The publisher's clock is ahead of the peer's, by minus this age.
  void warn_ahead(const TopicMirror& mirror, Duration age);
  [[nodiscard]] driving::PeerClock peer_clock() const;
  // How the topic drives this robot, by its type and our rule.
  [[nodiscard]] std::optional<driving::CommandType> steers() const;
  // The bytes to publish for a command. nullopt: the wheel is another's.
  [[nodiscard]] std::optional<Payload> steer(const MessageHead& message, const Payload& raw,
                                             const driving::Command& command, Duration age,
                                             TopicMirror& mirror, const Now& now);
  // Removes the origin, and returns its mirror.
  TopicMirror& take_out(std::map<OriginId, TopicMirror*>::iterator origin) {
    TopicMirror& mirror = *origin->second;
    volatile_ -= !is_transient_local(mirror.candidate(link_.id)->qos);
    origins_.erase(origin);
    return mirror;
  }
  std::map<OriginId, TopicMirror*> take_all() {
    volatile_ = 0;
    return std::exchange(origins_, {});
  }
  void leave_mirrors(const Now& now);
  // Do the last samples of all publishers come again when demand begins? Beside a volatile
  // publisher the exporter keeps nothing of the others.
  [[nodiscard]] bool all_come_again() const { return volatile_ == 0 && !drives(treatment(), key_); }
  // Nobody here subscribes, and the topic brings nothing: samples that its mirrors keep for late
  // subscribers become stale. So the mirrors are made again without samples; late subscribers get
  // the origin's last samples. False: the mirrors have to stay.
  [[nodiscard]] bool forget_kept(const Now& now) const;
  // The QoS policy that a subscriber here requests and that no mirror offers; empty: none.
  [[nodiscard]] std::string misfit() const;
  void note_end(const Ending& why) const;
  // Should the peer keep the messages of this topic that a break loses?
  [[nodiscard]] bool may_resume() const;
  // Do the rules of now let messages lose something?
  [[nodiscard]] bool wants_lossy() const;
  // May a message that was published before a break be published here after it?
  [[nodiscard]] bool may_come_late() const {
    const bool ever =
        treatment().resume || context_.options.resumes_imported;  // mutant: old_orders
    return ever && resumes(treatment(), key_.first, key_.second);
  }

  LinkTopics& peer_;
  ImportContext& context_;
  Link& link_;
  ChannelId number_;
  TopicKey key_;
  std::string type_hash_;
  std::string action_type_;
  Decision decision_;
  const Decodes decodes_;                        // what a demand names
  std::map<OriginId, Jobs::Pictures> pictures_;  // of the demand, by the worker that decodes them
  std::set<OriginId> broken_;  // a picture was dropped: those that refer to it are dropped, too
  bool pictures_fit_ = true;   // else there was no memory for a codec, and demands name none
  std::optional<TimePoint> demanded_again_at_;  // for a picture that refers to nothing
  bool lossy_ = false;                          // the demand lets messages lose something
  SentAs sent_as_;
  bool parameter_events_ = false;
  std::optional<driving::CommandType> command_;  // the topic drives this robot
  WheelState sent_wheel_ = WheelState::kFree;
  std::optional<double> ahead_ms_;  // of the last publisher with such a clock
  std::size_t volatile_ = 0;        // number of volatile origins
  MirrorWishes wishes_;
  bool may_keep_ = false;
  bool demanded_ = false;
  std::uint16_t demand_ = 0;         // number of the demand, once it was sent
  bool resume_ = false;              // the demand requests messages that a lost connection loses
  bool offers_resume_ = false;       // the peer may have kept messages for the first demand
  std::uint32_t last_sequence_ = 0;  // of the last message that arrived
  bool declined_kept_ = false;       // the peer was to discard the messages that it had kept
  std::map<OriginId, TopicMirror*> origins_;  // valid: this topic is a candidate of each
  LeftOutOrigins left_out_;
  std::deque<Waiting> waiting_;  // in order; the first is with a worker while `job_` is set
  Jobs::Job job_;
  struct HeldMessage {
    MessageHead head;
    Payload raw;
  };
  HeldBack<HeldMessage, PeerTopic*> held_;
  HeldBack<HeldMessage, PeerTopic*> unjudged_;  // commands that wait for the peer's clock
  DeltaDecoder deltas_;
  Pulse pulse_;
  std::uint64_t published_ = 0;
  std::uint64_t bytes_ = 0;
  std::uint64_t wire_bytes_ = 0;
  std::uint64_t too_large_ = 0;  // as the peer has told
  DropCounts dropped_;
  std::optional<double> latency_ms_;
};

}  // namespace connect_bridge
