// The local publisher that stands for one origin of the peers.
// One unit: the candidates, the claim and the publisher are one state; each change checks all
// three.
#pragma once

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/base/timers.hpp"
#include "core/driving/stamp_shift.hpp"
#include "core/driving/wheel.hpp"
#include "core/graph/claiming.hpp"
#include "core/graph/graph_view.hpp"
#include "core/link/link.hpp"
#include "core/mirrors/first_messages.hpp"
#include "core/mirrors/mirror_wish.hpp"
#include "core/policy/treatment.hpp"
#include "core/topics/topic_qos.hpp"

namespace connect_bridge {

struct ImportContext;
class PeerTopic;

using MirrorKey = std::pair<TopicKey, Gid>;  // local name and type, origin

// A link that offers the origin of a mirror.
struct MirrorCandidate {
  Link* link = nullptr;
  PeerTopic* offered = nullptr;  // null: the link has not offered the origin again, or is lost
  bool declined = false;         // we declined its type, and the peer has not withdrawn it yet
  Qos qos{};                     // of the origin, as this link offers it
  bool refused = false;          // a decline was sent because no publisher could be made

  [[nodiscard]] bool is_usable() const { return offered && !declined && link->open(); }
};

// The candidate of this link. Null: the link is not one of the candidates.
template <class Candidates>
auto* find_candidate(Candidates& candidates, LinkId link) {
  const auto it = std::find_if(candidates.begin(), candidates.end(),
                               [&](const MirrorCandidate& c) { return c.link->id == link; });
  return it == candidates.end() ? nullptr : &*it;
}

// The publisher in this graph that stands for an origin. Several links may offer the same origin
// (two clients in one graph): they are its candidates, and the first one feeds it. The mirror is in
// the graph while a candidate is left, unless the origin itself is in this graph or another bridge
// mirrors it. Single-threaded.
class TopicMirror final : private Appearing::Waiting {
 public:
  TopicMirror(ImportContext& context, MirrorKey key);
  TopicMirror(const TopicMirror&) = delete;
  TopicMirror& operator=(const TopicMirror&) = delete;

  // ---- the links that offer the origin
  // Adds the link as a candidate; the caller then calls refresh(). False: the link offers the
  // origin already.
  bool add_candidate(PeerTopic& offered, const OriginOffer& origin);
  // The origin's node has a name now.
  void name_node(const std::string& node, const Now& now);
  // The connection is lost: the candidate waits for its return.
  void lose_topic(LinkId link, const Now& now);
  // The link is dead: its candidate ends. Messages that subscribers here miss come when the link is
  // back, unless another link may feed them meanwhile.
  void lose_link(LinkId link);
  // Removes the link's candidate. The mirror may be over then; MirrorTable::remove_candidate()
  // checks that.
  void remove_candidate(LinkId link, const Now& now);
  // The candidate of this link. Null: the link does not offer the origin.
  [[nodiscard]] const MirrorCandidate* candidate(LinkId link) const {
    return find_candidate(candidates_, link);
  }
  [[nodiscard]] const std::vector<MirrorCandidate>& candidates() const { return candidates_; }
  // The account of the first one; null: there is none.
  [[nodiscard]] Payer payer() const;
  [[nodiscard]] bool is_over() const { return candidates_.empty() && !id_; }

  // ---- feeding, creation and destruction
  // Chooses the feeding link, and creates or destroys the publisher. True: the feeding link has not
  // sent the origin's last samples to this publisher.
  bool refresh(const Now& now);
  // Calls refresh(), then requests the last samples if the feeder or the publisher is new. `sends`:
  // a topic whose exporter sends them anyway.
  void update(const Now& now, const PeerTopic* sends = nullptr);
  // A rule may require another QoS now. True: the publisher was created again.
  bool adopt(const PeerTopic& offered, const Now& now);
  void destroy();
  // Drops the messages that wait until subscribers have found the mirror; they may come again.
  void drop_first();
  // Requests the origin's last samples again, if a link brings them.
  void ask_for_last_samples(const Now& now) const;
  void on_failed(const MirrorFailed& failed, const Now& now);
  // Logs that the type here differs from the peer's. `used`: the rules use the type nevertheless.
  void tell_difference(const std::string& hash_here, bool used) const;
  // The obstacle to the publisher may be gone: the next try is due now.
  void try_again();
  void on_time(const Now& now);
  // Logs once each subscriber here that cannot receive from the mirror because of its QoS, with the
  // name of its node. A subscriber whose node has no name yet is logged later.
  void warn_incompatible(const Now& now);

  // ---- demand
  // Do the origin's last samples come again when demand begins?
  [[nodiscard]] bool is_latched() const;
  // The mirror does not want data for a moment.
  void pause(const Now& now);
  // The mirror wants data for a while, even without a subscriber.
  void expect_subscriber(const Now& now);

  // ---- data
  // The reason why the mirror publishes no messages from this link; nullopt: none.
  [[nodiscard]] std::optional<DropReason> refusal(const Link& link) const;
  // Publishes the message, or returns the reason against it: it was published before, or exceeds
  // the bytes that may be kept for late subscribers. If fewer samples of its size may be kept than
  // now, the publisher is created again with less depth. Then the exporter is asked for the last
  // samples. A message that has to wait is lost if it cannot be published before it expires.
  [[nodiscard]] std::optional<DropReason> publish(std::uint64_t number, const Payload& raw,
                                                  TimePoint expires, const Now& now);
  // Was the message with this number of the origin published before?
  [[nodiscard]] bool has_published(std::uint64_t number) const {
    return number != 0 && number <= last_number_;
  }
  // Publishes a zero that the origin has not sent, behind its messages.
  void halt(const Payload& zero, const Now& now);
  // Facts about the origin's commands, if it steers this robot.
  struct Steered {
    driving::OriginSeen seen;
    driving::AgeJudge ages;
    ConnectionId judged_on;  // the connection whose clock `ages` is about
  };
  [[nodiscard]] Steered& steered() { return steered_; }
  // Bytes that the middleware may keep for late subscribers, by the largest sample seen.
  [[nodiscard]] std::uint64_t kept_bytes() const {
    return id_ && keeps_samples() ? depth() * sample_bytes_ : 0;
  }
  // The largest number of the samples that were published, if `feeder` feeds the mirror and its
  // origin's last samples come again; 0: none.
  [[nodiscard]] std::uint64_t last_number_of(const PeerTopic& feeder) const;
  // Do messages wait until subscribers have found the mirror?
  [[nodiscard]] bool has_first() const { return !first_.empty(); }
  [[nodiscard]] bool is_claimed() const { return claiming_.holds(); }
  [[nodiscard]] const MirrorKey& key() const { return key_; }
  [[nodiscard]] MirrorId id() const { return id_; }
  [[nodiscard]] const Qos& qos() const { return qos_; }  // of the publisher
  [[nodiscard]] const OriginOffer& origin() const { return origin_; }
  [[nodiscard]] const std::string& action_type() const { return action_type_; }
  [[nodiscard]] const std::string& type_hash() const { return type_hash_; }

 private:
  using Timer = Timers<TopicMirror*>::Timer;
  [[nodiscard]] Timers<TopicMirror*>& timers() const;

  void appear(const Now& now) override { update(now); }
  void create(const Now& now);
  // Did an earlier mirror publish samples, and somebody subscribes now who did not get them?
  [[nodiscard]] bool misses_samples() const;
  void note_published(Link& lost) const;
  void vanish(bool exists = true);
  // The payload, held in the account of its identity until it is published, if it is large:
  // publishing takes a while.
  [[nodiscard]] Payload held_if_large(const Payload& raw) const;
  // The number of samples of this size that the mirror may keep; at most depth().
  [[nodiscard]] std::uint32_t fitting_depth(std::uint64_t sample_bytes) const;
  // The bytes that the mirror may keep beside the other mirrors of its link. All of them together
  // keep at most mirror_bytes_max. This one keeps at most its bytes now and 1 / `share` (4 or more)
  // of the link's remaining room.
  [[nodiscard]] std::uint64_t room(std::uint64_t share) const;
  // "/chatter", or "/chatter of /talker"
  [[nodiscard]] std::string name(bool with_node) const;
  // Logs a line once for the feeding peer's identity, as the line has words of that peer. Without a
  // link that offers the mirror nothing is logged.
  void log_once(LogLevel level, const std::string& text) const;
  // Logs why the publisher could not be made.
  void tell_failed(const MirrorFailed& failed) const;
  // Counts the kept bytes in the budget of the feeding link.
  void charge();
  [[nodiscard]] PeerTopic* feeder() const {
    return candidates_.empty() ? nullptr : candidates_.front().offered;
  }
  [[nodiscard]] bool may_exist() const;
  // Is it certain that no other bridge is about to claim the origin before this one?
  [[nodiscard]] bool has_settled(const Now& now);
  void give_up_claim();
  [[nodiscard]] bool has_waited_for_name(const Now& now);
  [[nodiscard]] bool may_be_made(const Now& now);
  [[nodiscard]] MirrorWish wish(const Now& now) const;
  void update_demand(const Now& now) { wish_.settle(wish(now), now); }
  // Adopts the feeding link's offer. True: the publisher did not fit it.
  bool follow_feeder();
  [[nodiscard]] bool is_of_its_type(const PeerTopic& offered) const;
  [[nodiscard]] std::uint32_t depth() const { return std::min(qos_.depth, depth_max_); }
  [[nodiscard]] bool keeps_samples() const { return is_transient_local(qos_); }

  ImportContext& context_;
  MirrorKey key_;
  MirrorId id_;  // none: not created
  OriginOffer origin_;
  Qos qos_;
  std::string type_hash_;
  std::string action_type_;
  bool any_definition_ = false;              // whether the rules allow a type mismatch
  std::vector<MirrorCandidate> candidates_;  // the feeding link first
  CountedWish wish_;
  Claiming claiming_;
  FirstMessages first_;
  Timer ends_;      // no candidate is left: time for the middleware to deliver the last samples
  Timer expected_;  // until then the mirror wants data without a subscriber
  Timer settles_;   // until then no publisher is made: other bridges may claim the origin
  Timer pauses_;    // until then the mirror wants no data
  Timer naming_;    // until then no publisher is made unless the origin's node has a name
  Timer unnamed_;   // then subscribers without a name are logged as incompatible, too
  Timer retries_;   // until then no publisher is made, after a failure
  ProxyNames::Hold proxy_node_;     // owns the publisher; null: our own node does
  std::uint64_t last_number_ = 0;   // of the last message that was published, or waits to be
  std::uint64_t before_first_ = 0;  // last_number_ before the first message that waits
  std::uint64_t sample_bytes_ = 0;  // of the largest sample that was published
  std::set<Gid> reached_;           // subscribers who got the samples from an earlier mirror
  std::uint32_t fresh_ = 0;         // samples of this one, at most as many as it keeps
  Budget::Hold kept_;               // kept_bytes(), held in the feeding link's memory
  // Number of samples of this size that may be kept.
  std::uint32_t depth_max_ = std::numeric_limits<std::uint32_t>::max();
  bool is_local_ = false;  // the origin lives, or lived, in the local graph: a loop
  bool failed_ = false;    // until the origin is offered again, or another attempt is due
  Steered steered_;
};

}  // namespace connect_bridge
