// What is listened to at the other side of the links.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/graph/side_view.hpp"
#include "core/link/link.hpp"

namespace connect_bridge {

// The topics of ours that nodes of the peers' graphs listen to, as reported in `listeners`
// messages. A topic counts while our rules and the `accepts` of a peer that listens allow that peer
// the topic, and there is a place for it: what is published here needs none, but of what nobody
// publishes, and a peer may invent, only so many are subscribed. Others wait until a place is free.
// Single-threaded.
class PeerListeners {
 public:
  // Topics that nobody publishes here and that count, for the peers of one identity. Of all:
  // Shares::kListenedMax.
  static constexpr std::uint64_t kUnpublishedMax = 256;

  // It outlives this.
  explicit PeerListeners(const SideView& side) : side_(side) {}
  PeerListeners(const PeerListeners&) = delete;
  PeerListeners& operator=(const PeerListeners&) = delete;

  // An error ends the connection: a number in use, too many, or changes without end.
  Result<Nothing> on_listeners(Link& link, const Listeners& change, const Now& now);
  // Our rules, the link's identity or the peer's `accepts` have changed.
  void review(const Link& link, const Now& now);
  void on_link_lost(LinkId link);
  // Publishers came or went.
  void on_graph(const Now& now);
  // Topics that wait may have a place now.
  void on_time(const Now& now);
  [[nodiscard]] std::optional<TimePoint> deadline() const { return due_; }

  // The topics that count, or do not any longer, or for other links, since the last call.
  std::set<TopicKey> take_changes() { return std::exchange(changed_, {}); }
  [[nodiscard]] bool listens(const TopicKey& topic) const { return counting(topic) != nullptr; }
  // The links that listen to it.
  [[nodiscard]] std::vector<LinkId> links_of(const TopicKey& topic) const;
  // All that this peer listens to, whether our rules allow it or not; local names.
  [[nodiscard]] std::vector<TopicKey> told_by(LinkId link) const;
  // The weakest of what our rules require for those links that listen and `count`: reliability and
  // durability.
  [[nodiscard]] QosOverride rules_of(const TopicKey& topic,
                                     const std::function<bool(LinkId)>& count) const;
  // Where to note what is logged once about a topic that only listeners have: what their peers make
  // this side say must not keep other lines out.
  [[nodiscard]] TellOnce& told_of(const TopicKey& topic) const;
  // The type hash that was reported; empty: none.
  [[nodiscard]] std::string type_hash_of(const TopicKey& topic) const;

 private:
  struct Topic;
  // A topic as one peer has named it.
  struct Told {
    std::uint32_t listeners = 0;
    std::string type_hash;
    Topic* topic = nullptr;  // while the peer may have it
    QosOverride rule;        // the same
  };
  struct OfLink final : Appearing::Waiting {
    OfLink(PeerListeners& owner, Link& of) : link(&of), owner_(owner) {}
    void appear(const Now& now) override { owner_.serve(*this, now); }

    Link* const link;
    // By the peer's numbers; without a topic: not one that it can have.
    std::map<ListenerId, std::optional<TopicKey>> listeners;
    std::map<TopicKey, Told> topics;

   private:
    PeerListeners& owner_;
  };
  struct Topic {
    std::map<LinkId, const Told*> links;  // that may have it
    bool counts = false;
    Budget::Hold place;  // while it counts and nobody publishes it
    LinkId payer;        // of whose account that is

    // It counts without a place, as it was published here when it was looked at last.
    [[nodiscard]] bool is_free() const { return counts && !payer; }
  };

  void add(OfLink& of_link, const ListenerTold& told);
  void remove(OfLink& of_link, std::map<ListenerId, std::optional<TopicKey>>::iterator listener);
  // Whether the peer may have it, and by which rule.
  void decide(const OfLink& of_link, const TopicKey& key, Told& told);
  void join(const OfLink& of_link, const TopicKey& key, Told& told);
  void leave(const OfLink& of_link, const TopicKey& key, Told& told);
  // Whether the topic may count where it is now, and at whose expense.
  void review(const TopicKey& key, Topic& topic);
  // At this link's expense, if there is room.
  void take_place(Topic& topic, const Link& payer);
  void give_back(Topic& topic);
  void count(const TopicKey& key, Topic& topic, bool counts);
  // Gives places to the topics of this link that wait, as far as there are any.
  void serve(OfLink& of_link, const Now& now);
  [[nodiscard]] const Topic* counting(const TopicKey& topic) const;

  const SideView& side_;
  std::map<LinkId, OfLink> links_;
  std::map<TopicKey, Topic> topics_;
  std::set<TopicKey> changed_;
  std::optional<TimePoint> due_;  // when those that wait for a place are to be looked at again
};

}  // namespace connect_bridge
