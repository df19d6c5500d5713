// The local publisher that stands for one origin of the peers.
// One unit: the candidates, the claim and the publisher are one state; each change asks all three.
#pragma once

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/timers.hpp"
#include "core/graph/claiming.hpp"
#include "core/graph/graph_view.hpp"
#include "core/link/link.hpp"
#include "core/policy/treatment.hpp"
#include "core/topics/first_messages.hpp"
#include "core/topics/mirror_wish.hpp"
#include "core/topics/topic_qos.hpp"

namespace connect_bridge {

struct ImportContext;
class PeerTopic;

using MirrorKey = std::pair<TopicKey, Gid>;  // local name and type, origin

// A link that offers the origin of a mirror.
struct MirrorCandidate {
  Link* link = nullptr;
  PeerTopic* offered = nullptr;  // null: it is lost, or has not offered it again
  bool declined = false;         // its type, and the peer has not withdrawn it yet
  Qos qos{};                     // of the origin, as this link offers it
  bool told = false;             // that no publisher could be made, whatever the reason

  [[nodiscard]] bool is_usable() const { return offered && !declined; }
};

// Null: the link is not one of them.
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

  // ---- who offers it
  // False: the link offers the origin already. Else the caller calls refresh().
  bool add_candidate(PeerTopic& offered, const OriginOffer& origin);
  // The origin's node has a name now.
  void name_node(const std::string& node, const Now& now);
  // The connection is lost: the candidate waits for its return.
  void lose_topic(LinkId link, const Now& now);
  // The link is dead: its candidate ends. What subscribers here miss comes when the link is back,
  // unless another link may feed them meanwhile.
  void lose_link(LinkId link);
  // After this the mirror may be over (ImportContext::remove_candidate checks).
  void remove_candidate(LinkId link, const Now& now);
  // Null: the link does not offer the origin.
  [[nodiscard]] const MirrorCandidate* candidate(LinkId link) const {
    return find_candidate(candidates_, link);
  }
  [[nodiscard]] const std::vector<MirrorCandidate>& candidates() const { return candidates_; }
  [[nodiscard]] bool is_over() const { return candidates_.empty() && !id_; }

  // ---- what follows from what is known
  // Chooses the feeding link, creates or destroys the publisher. True: the link that feeds it now
  // has not sent the origin's last samples to it.
  bool refresh(const Now& now);
  // As refresh(), and asks the feeding link for these samples, unless it is the link of `sends`:
  // that exporter sends them anyway.
  void update(const Now& now, const PeerTopic* sends = nullptr);
  // A rule may require another QoS now. True: the publisher was created again.
  bool adopt(const PeerTopic& offered, const Now& now);
  void destroy();
  // The messages that wait until subscribers have found the mirror are not published; they may come
  // again.
  void drop_first();
  // The origin's last samples are asked for again, if a link brings them.
  void ask_for_last_samples(const Now& now) const;
  void on_failed(const MirrorFailed& failed, const Now& now);
  void on_time(const Now& now);
  // Logs once each subscriber here that cannot receive from it because of its QoS, by the name of
  // its node: one that the graph does not tell at first is waited for.
  void warn_incompatible(const Now& now);

  // ---- demand
  // Whether its origin's last samples come again when demand begins.
  [[nodiscard]] bool is_latched() const;
  // It does not want data for a moment.
  void pause(const Now& now);
  // It wants data for a while, with or without a subscriber.
  void expect_subscriber(const Now& now);

  // ---- data
  // Why the mirror publishes no messages from this link; nullopt: it publishes them.
  [[nodiscard]] std::optional<DropReason> refusal(const Link& link) const;
  // Publishes, or returns why not: it was published before, or exceeds what may be kept for late
  // subscribers. If fewer samples of its size may be kept than now, the publisher is created again
  // with less depth, and the exporter is asked for the last samples.
  // What has to wait is lost if it cannot be published before it expires.
  [[nodiscard]] std::optional<DropReason> publish(std::uint64_t number, const Payload& raw,
                                                  TimePoint expires, const Now& now);
  // What the middleware may keep for late subscribers, by the largest sample seen.
  [[nodiscard]] std::uint64_t kept_bytes() const {
    return id_ && keeps_samples() ? depth() * sample_bytes_ : 0;
  }
  // Whether messages wait until subscribers have found the mirror.
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

  void appear(const Now& now) override { update(now); }
  void create(const Now& now);
  void vanish(bool exists = true);
  // A large sample is its identity's until it is published, which takes a while.
  [[nodiscard]] Payload held_if_large(const Payload& raw) const;
  // What the middleware may keep counts in the budget of the feeding link.
  void charge();
  [[nodiscard]] PeerTopic* feeder() const {
    return candidates_.empty() ? nullptr : candidates_.front().offered;
  }
  [[nodiscard]] bool may_exist() const;
  // Whether no other bridge can be about to claim the origin before this one.
  [[nodiscard]] bool has_settled(const Now& now);
  void give_up_claim();
  [[nodiscard]] bool has_waited_for_name(const Now& now);
  [[nodiscard]] bool may_be_made(const Now& now);
  [[nodiscard]] MirrorWish wish(const Now& now) const;
  void update_demand(const Now& now) { wish_.settle(wish(now), now); }
  // Whether the publisher does not fit what the feeding link offers now.
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
  bool any_definition_ = false;              // whether the rules allow that
  std::vector<MirrorCandidate> candidates_;  // the feeding one first
  CountedWish wish_;
  Claiming claiming_;
  FirstMessages first_;
  Timer ends_;      // no candidate is left: time for the middleware to deliver the last samples
  Timer expected_;  // until then demanded without a subscriber
  Timer settles_;   // until then it is not made: other bridges may claim the origin
  Timer pauses_;    // until then it does not want data
  Timer naming_;    // until then it is not made before its origin's node has a name
  Timer unnamed_;   // then subscribers without a name are logged as incompatible, too
  Timer retries_;   // until then it is not made, as it could not be
  std::uint64_t last_number_ = 0;   // of what was published, or waits to be
  std::uint64_t before_first_ = 0;  // the same before the first one that waits
  std::uint64_t sample_bytes_ = 0;  // of the largest that was published
  Budget::Hold kept_;               // of the feeding link's memory: kept_bytes()
  // How many samples of this size may be kept.
  std::uint32_t depth_max_ = std::numeric_limits<std::uint32_t>::max();
  bool is_local_ = false;  // the origin lives, or lived, in the local graph: a loop
  bool failed_ = false;    // until it is offered again, or another attempt is due
};

}  // namespace connect_bridge
