// A link to a peer; it outlives its connections. Messages that arrive go to the owners of their
// channels.
// One unit: channel numbers, owners and the connection change together; a message that comes
// between two of these changes must find one owner.
#pragma once

#include <chrono>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/base/pace.hpp"
#include "core/connection/channel.hpp"
#include "core/connection/connection.hpp"
#include "core/flow/rate_limit.hpp"
#include "core/link/account.hpp"
#include "core/link/arrived.hpp"
#include "core/link/due_links.hpp"
#include "core/link/link_accepts.hpp"
#include "core/link/link_end.hpp"
#include "core/link/link_life.hpp"
#include "core/link/link_login.hpp"
#include "core/link/link_mirrors.hpp"
#include "core/link/published.hpp"
#include "core/policy/names.hpp"
#include "core/ports/actions.hpp"
#include "core/ports/inputs.hpp"
#include "core/ports/status.hpp"

namespace connect_bridge {

class Link;

// Events that concern a link as a whole, and no channel: messages of its peer, and changes of its
// state. An error closes the connection with its code.
class LinkUser {
 public:
  // ---- messages of the peer
  virtual Result<Nothing> on(Link& link, const Offer& offer, const Now& now) = 0;
  virtual Result<Nothing> on(Link& link, Accepts accepts, const Now& now) = 0;
  virtual Result<Nothing> on(Link& link, const Listeners& listeners, const Now& now) = 0;
  virtual Result<Nothing> on(Link& link, const Ask& ask, const Now& now) = 0;
  virtual Result<Nothing> on(Link& link, const Answered& answer, const Now& now) = 0;
  virtual Result<Nothing> on(Link& link, const Renew& renew, const Now& now) = 0;
  virtual Result<Nothing> on(Link& link, const Renewed& renewed, const Now& now) = 0;
  virtual void on_peer_time(Link& link, const TimeReply& reply, const Now& now) = 0;

  // ---- changes of the link's state (Links)
  // A connection carries the link from now on.
  virtual void on_link_open(Link& link, const Now& now) = 0;
  // The link goes on, but the process at the other end is another one and remembers no calls.
  virtual void on_peer_replaced(Link& link, const Now& now) = 0;
  // The connection has closed and is about to go, and its channels with it: as many as `link.end`
  // allows. Mirrors and calls wait. True: all channels have ended.
  [[nodiscard]] virtual bool on_link_lost(Link& link, const Now& now) = 0;
  // The link was lost for dead_after, or left for good: its calls and mirrors end, as many as
  // `link.end` allows. True: all have ended.
  [[nodiscard]] virtual bool on_link_dead(Link& link, const Now& now) = 0;
  // The link's identity has changed, and perhaps its rights.
  virtual void on_identity_changed(Link& link, const Now& now) = 0;
  // Is something kept for a dead link's return?
  [[nodiscard]] virtual bool resumes(const Link& link) const = 0;
  // A dead link will not return: all that is kept for it is dropped.
  virtual void on_link_forgotten(Link& link, const Now& now) = 0;
  // The link goes on with the same process, which has forgotten the session and its backlogs.
  virtual void on_session_forgotten(Link& link, const Now& now) = 0;
  // The time for offers after a reconnect is over: the peer will not offer the rest again.
  virtual void on_offers_over(Link& link, const Now& now) = 0;

 protected:
  ~LinkUser() = default;
};

// The process at the other end of a link.
struct LinkPeer {
  Token128 side;        // the process; zero: there was no connection yet
  std::string address;  // for people
  std::string node;
};

class Link final : public ConnectionUser {
 public:
  static constexpr std::size_t kOfferedMax = 4096;

  // `resume_for`: see LinkOptions. `due`: where the link marks itself, outlives the link; null:
  // nowhere.
  Link(LinkId link, LinkUser& user, std::shared_ptr<Account> own = std::make_shared<Account>(),
       Duration resume_for = {}, DueLinks* due = nullptr)
      : id(link), account(std::move(own)), life(resume_for), user_(user), due_(due) {}
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  const LinkId id;
  const std::shared_ptr<Account> account;  // of its identity
  Budget memory{&account->memory};         // bytes that the peer makes this side hold
  LinkLife life;
  LinkEnd end;
  LinkLogin login;
  NameMap names;  // for the identity; set before anything is offered, and never changed
  LinkAccepts accepts{account->accepts};         // what the peer would import
  LinkMirrors mirrors{account->places, memory};  // endpoints that appear here for the peer
  ArrivedTopics arrived;
  Published published;

  // ---- the connection
  // The connection carries the link from now on; there was none.
  void opened(std::unique_ptr<Connection> connection, const Now& now);
  // The connection is gone, or about to be, and does nothing more. Owners of channels may still
  // read it, until drop_connection().
  void lose(Loss loss, const Now& now);
  // Destroys the connection, with its channels and all that belonged to it.
  void drop_connection();
  // Null while the link is lost.
  [[nodiscard]] Connection* connection() const { return connection_.get(); }
  [[nodiscard]] bool open() const { return connection_ && connection_->open(); }
  // Lost, and not all channels of its connection have ended.
  [[nodiscard]] bool loses() const { return connection_ && life.waits(); }
  // The peer of the last connection; also known while the link is lost.
  [[nodiscard]] const LinkPeer& peer() const { return peer_; }
  // "node at address", for log lines.
  [[nodiscard]] std::string label() const { return peer_.node + " at " + peer_.address; }
  // The identity's name, or label() without one. For log lines about all links of an identity.
  [[nodiscard]] std::string owner() const {
    return login.identity().name.empty() ? label() : login.identity().name;
  }
  // Sends the message. Without a connection nothing is sent: owners of state send it again on the
  // next one.
  void send(const Control& message) {
    mark();
    if (connection_) connection_->send(message);
  }
  void send(std::string text, bool completes = false) {
    mark();
    if (connection_) connection_->send(std::move(text), completes);
  }
  // The first `accepts` of a connection names the peer's texts that are kept from the one before;
  // none: nothing is kept, or they were named.
  [[nodiscard]] Token128 take_base() { return std::exchange(base_, Token128{}); }
  // The link's next connection begins without them.
  void forget_texts();
  void fail(Error error) {
    mark();
    if (connection_) connection_->fail(error.code, std::move(error.message));
  }
  // Does the work that is due on the connection, and checks the peer's `accepts` if it is time.
  void on_time(const Now& now);
  // The time at which on_time() must be called, also for the link's life and its login.
  [[nodiscard]] std::optional<TimePoint> deadline() const;
  // Marks the link when it may have work to do: it has failed, has something to send, or its
  // deadline has changed. The functions here that send or fail call this themselves.
  void mark() const {
    if (due_) due_->mark(id);
  }
  // Belongs to the owner of the links, who waits for deadline() with it.
  DueLinks::Timer timer;

  // Where its work takes turns.
  [[nodiscard]] JobTurn turn() const { return {account->number, id}; }

  // The rate limit that our rules set for a publisher on a topic (name, type). Null: there is none.
  // Valid until the next call.
  [[nodiscard]] RateLimit* rate_of(const std::pair<std::string, std::string>& topic,
                                   const Gid& publisher, const Treatment& treatment,
                                   const Now& now);
  // May the body be decompressed now? If so, it is counted.
  [[nodiscard]] bool may_inflate(const InMessage& message, const Now& now) {
    // Pictures are usually so many times smaller than other compressed messages.
    constexpr std::uint64_t kSmaller = 128;
    const std::uint64_t counted = (is_vp8(message.codec) ? kSmaller : 1) * message.body.size();
    return message.codec == Codec::kNone ||
           account->may_inflate(message.raw_bytes, counted, now.steady);
  }

  // ---- while there is a connection
  [[nodiscard]] const Outbox& outbox() const { return connection_->outbox(); }
  // The outbox, to change what is sent.
  [[nodiscard]] Outbox& sending() {
    mark();
    return connection_->outbox();
  }
  // Tells the channels whose messages have left and report that.
  void report_left(const Now& now);
  [[nodiscard]] const ClockEstimate& clock() const { return connection_->clock(); }
  [[nodiscard]] std::uint32_t peer_message_bytes_max() const {
    return connection_->peer().message_bytes_max;
  }

  // ---- channels on which the peer sends
  // The peer offers a channel under a new number. Until somebody takes the channel, its messages
  // are dropped, as after a decline.
  void expect_offered(ChannelId number, InterfaceKind kind) {
    incoming_[number] = {nullptr, true, kind == InterfaceKind::kService};
    channels_.resize(++offered_);
  }
  void take_offered(ChannelId number, IncomingChannel& channel) {
    incoming_[number].channel = &channel;
  }
  // Requests of the peer come on this number.
  void expect(ChannelId number, IncomingChannel& channel) {
    incoming_[number] = {&channel, false, true};
  }
  // The channel has ended here. Messages that the peer still sends on it are dropped, until the
  // peer withdraws it.
  void let_go(ChannelId number);
  // The channel goes on behind this sequence, the last one of the connection before.
  void resume_incoming(ChannelId number, std::uint32_t sequence);
  // The peer will not send on the channel any more.
  void forget(ChannelId number);
  // The peer takes an offer back. False: it does so too often.
  [[nodiscard]] bool note_withdrawal(const Now& now) { return withdrawals_.take(now.steady); }
  [[nodiscard]] bool expects(ChannelId channel) const { return incoming_.contains(channel); }
  [[nodiscard]] std::uint32_t offered() const { return offered_; }
  // The channel is not imported, or not wholly: sends `decline`. Declines of up to kDeclinedMax
  // channels are remembered for people.
  void decline(ChannelId number, InterfaceKind kind, std::pair<std::string, std::string> key,
               const Ending& why);
  static constexpr std::size_t kDeclinedMax = 64;
  struct Declined {
    InterfaceKind kind;
    std::pair<std::string, std::string> key;  // local name, type
    Ending why;
  };
  [[nodiscard]] const std::map<ChannelId, Declined>& declined() const { return declined_; }

  // ---- channels on which this side sends
  // A new number. The caller adds the queue to the outbox.
  ChannelId open_channel(OutgoingChannel& channel) {
    const ChannelId number{++last_channel_};
    outgoing_[number] = &channel;
    return number;
  }
  void close_channel(ChannelId number) { outgoing_.erase(number); }
  // Closes the channel, removes its queue, and sends `withdraw` to the peer.
  void withdraw(ChannelId number, const Ending& why = {});
  // A peer takes at least this many channels, and may close the connection for more.
  [[nodiscard]] bool may_offer() const { return outgoing_.size() < kOfferedMax; }
  [[nodiscard]] OutgoingChannel* outgoing(ChannelId number) const {
    const auto it = outgoing_.find(number);
    return it == outgoing_.end() ? nullptr : it->second;
  }
  // Has this side ever sent on the number? A message about an ended channel crossed its withdraw,
  // and is not the peer's error.
  [[nodiscard]] bool was_opened(ChannelId number) const { return number.value <= last_channel_; }

  // ---- for people
  // Sends the faults here that concern the peer: at most kFindingsMax, and only if they differ from
  // the last ones of this connection. Local names.
  void send_findings(const std::vector<PeerFinding>& findings);
  // Why the link is about to be lost: kept for its status, the newest LinkBreak::kShownMax.
  void note_break(Failure why, bool by_peer, const Now& now);
  // The link's own part of its status.
  [[nodiscard]] LinkStatus status() const;
  [[nodiscard]] std::uint64_t memory_bytes() const;  // of queues and unfinished messages
  // The counts of a channel that ended are kept with the topic as long as the link exists.
  // `of_queued`: why messages that waited then do not arrive.
  void keep_counts(std::vector<TopicStatus> topics, DropReason of_queued = DropReason::kLinkLost);
  void add_past(TopicStatus& topic) const;

  // ---- arrivals
  [[nodiscard]] Incoming* incoming(ChannelId channel) override {
    const auto it = incoming_.find(channel);
    return it == incoming_.end() ? nullptr : &it->second;
  }
  Result<Nothing> on_control(Control& control, const Now& now) override;
  void on_delivered(const Outbox::Delivered& whole, const Now& now) override;
  [[nodiscard]] bool may_read_texts(std::uint32_t raw_bytes, const Now& now) override {
    if (!texts_.ready(now.steady)) return false;
    texts_.take(raw_bytes, now.steady);
    return true;
  }
  void on_peer_time(const TimeReply& reply, const Now& now) override {
    user_.on_peer_time(*this, reply, now);
  }

 private:
  static constexpr double kTextsPerSecond = 4 << 20;

  Result<Nothing> on(Accepts& accepts, const Now& now);
  Result<Nothing> take_accepts(const Now& now);
  Result<Nothing> on(OriginsChanged& change, const Now& now);
  Result<Nothing> on(Withdraw& withdraw, const Now& now);
  Result<Nothing> on(Demand& demand, const Now& now);
  Result<Nothing> on(Decline& decline, const Now& now);
  Result<Nothing> on(Attach& attach, const Now& now);
  Result<Nothing> on(Attached& attached, const Now& now);
  Result<Nothing> on(Refuse& refuse, const Now& now);
  Result<Nothing> on(Forget& forget, const Now& now);
  Result<Nothing> on(Wheel& wheel, const Now& now);
  Result<Nothing> on(Findings& findings, const Now& now);
  template <class Other>
  Result<Nothing> on(const Other& message, const Now& now) {
    return user_.on(*this, message, now);
  }

  void keep_texts();

  LinkUser& user_;
  DueLinks* const due_;
  // Texts of the last first round that was complete, by direction.
  Bytes sent_texts_, received_texts_;
  Token128 sent_digest_;
  Budget::Hold texts_held_;
  Token128 base_;
  bool names_base_ = false;  // the peer's next `accepts` may: the first one of the connection
  // As many bytes as may wait to be sent come at once. Samples do not count here: they are dropped,
  // but texts that come too fast end the connection.
  Throttle texts_{kTextsPerSecond, std::chrono::seconds(8)};
  std::unique_ptr<Connection> connection_;
  LinkPeer peer_;
  std::deque<LinkBreak> breaks_;
  // Findings of this connection: those sent, by wire names, and the peer's, by local names.
  std::vector<PeerFinding> sent_findings_, peer_findings_;
  // Behind the connection, so that their streams end first. Not hashed: the peer chooses the
  // numbers.
  std::map<ChannelId, Incoming> incoming_;
  std::map<ChannelId, Declined> declined_;  // declined channels of incoming_
  std::unordered_map<ChannelId, OutgoingChannel*> outgoing_;
  std::uint32_t offered_ = 0;  // channels that the peer offers on this connection
  Budget::Hold channels_{account->channels.hold(0)};  // as many as are offered
  std::uint32_t ended_ = 0;         // ended request channels that the peer has not withdrawn
  std::uint32_t last_channel_ = 0;  // the last number on which this side has sent
  // The rate limits of our rules, by topic, type and publisher: a peer that offers a topic again
  // gets no more.
  struct Rate {
    RateLimit limit;
    Budget::Hold held;
  };
  std::map<std::pair<std::pair<std::string, std::string>, Gid>, Rate> rates_;
  TimePoint next_rates_review_{};  // a full table is searched for idle rates no sooner
  // The counts of earlier connections, by exported, topic and type.
  struct Past {
    TopicStatus counts;  // without names
    Budget::Hold held;
  };
  std::map<std::tuple<bool, std::string, std::string>, Past> past_;
  // Channels and origins that a peer offers and withdraws cost this graph endpoints that come and
  // go.
  Pace withdrawals_{account->withdrawals};
};

using LinkTable = std::map<LinkId, Link>;

[[nodiscard]] inline std::vector<Link*> all_of(LinkTable& links) {
  std::vector<Link*> all;
  for (auto& [id, link] : links) all.push_back(&link);
  return all;
}

}  // namespace connect_bridge
