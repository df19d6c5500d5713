// Listeners at the other side of the links.
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

// Topics of ours that nodes of the peers' graphs subscribe to, as `listeners` messages report them.
// A topic counts while a peer has a listener, our rules and its `accepts` allow it the topic, and
// the topic has a place. A topic with a publisher here needs no place. Others need one, as a peer
// may invent them; they wait until a place is free. Single-threaded.
class PeerListeners {
 public:
  // Limit of topics without a publisher here that count, for the peers of one identity. The limit
  // for all identities is Shares::kListenedMax.
  static constexpr std::uint64_t kUnpublishedMax = 256;

  // `side` outlives this object.
  explicit PeerListeners(const SideView& side) : side_(side) {}
  PeerListeners(const PeerListeners&) = delete;
  PeerListeners& operator=(const PeerListeners&) = delete;

  // Takes a report of the peer. An error closes the connection: a number in use, too many
  // listeners, or changes too often.
  Result<Nothing> on_listeners(Link& link, const Listeners& change, const Now& now);
  // Our rules, the link's identity or the peer's `accepts` have changed.
  void review(const Link& link, const Now& now);
  void on_link_lost(LinkId link);
  // Publishers came or went.
  void on_graph(const Now& now);
  // Topics that wait may have a place now.
  void on_time(const Now& now);
  [[nodiscard]] std::optional<TimePoint> deadline() const { return due_; }

  // The topics that count now, or no longer, or for other links, since the last call.
  std::set<TopicKey> take_changes() { return std::exchange(changed_, {}); }
  [[nodiscard]] bool listens(const TopicKey& topic) const { return counting(topic) != nullptr; }
  // The links that have a listener for the topic.
  [[nodiscard]] std::vector<LinkId> links_of(const TopicKey& topic) const;
  // One of them.
  [[nodiscard]] Link& link(LinkId link) const { return *links_.at(link).link; }
  // All topics that this peer subscribes to, even without a rule that allows them; local names.
  [[nodiscard]] std::vector<TopicKey> reported_by(LinkId link) const;
  // The weakest reliability and durability that our rules set for the listening links for which
  // `count` is true.
  [[nodiscard]] QosOverride rules_of(const TopicKey& topic,
                                     const std::function<bool(LinkId)>& count) const;
  // The record of lines that are logged once, for a topic that only listeners have. The account of
  // a listening peer owns it, so lines that a peer causes keep no others out.
  [[nodiscard]] LoggedOnce& logged_of(const TopicKey& topic) const;
  // The type hash that a peer reported; empty: none.
  [[nodiscard]] std::string type_hash_of(const TopicKey& topic) const;

 private:
  struct Topic;
  // A topic as one peer has reported it.
  struct Reported {
    std::uint32_t listeners = 0;
    std::string type_hash;
    Topic* topic = nullptr;  // set while the peer may have the topic
    QosOverride rule;        // as long as `topic` is set
  };
  struct OfLink final : Appearing::Waiting {
    OfLink(PeerListeners& owner, Link& of) : link(&of), owner_(owner) {}
    void appear(const Now& now) override { owner_.serve(*this, now); }

    Link* const link;
    // Keyed by the peer's numbers. Without a topic: the peer cannot have it.
    std::map<ListenerId, std::optional<TopicKey>> listeners;
    std::map<TopicKey, Reported> topics;
    Budget::Hold held;  // its listeners, among those of its identity

   private:
    PeerListeners& owner_;
  };
  struct Topic {
    std::map<LinkId, const Reported*> links;  // links that may have the topic
    bool counts = false;
    Budget::Hold place;  // while the topic counts and nobody publishes it here
    LinkId payer;        // the link whose account holds the place

    // Counts without a place: the topic had a publisher here at the last check.
    [[nodiscard]] bool is_free() const { return counts && !payer; }
  };

  void add(OfLink& of_link, const ListenerReport& report);
  void remove(OfLink& of_link, std::map<ListenerId, std::optional<TopicKey>>::iterator listener);
  // Decides whether the peer may have the topic, and by which rule.
  void decide(const OfLink& of_link, const TopicKey& key, Reported& reported);
  void join(const OfLink& of_link, const TopicKey& key, Reported& reported);
  void leave(const OfLink& of_link, const TopicKey& key, Reported& reported);
  // Decides whether the topic counts, and which account pays.
  void review(const TopicKey& key, Topic& topic);
  // Takes a place from this link's account, if there is room.
  void take_place(Topic& topic, const Link& payer);
  void give_back(Topic& topic);
  void count(const TopicKey& key, Topic& topic, bool counts);
  // Gives places to the waiting topics of this link, as far as there are any.
  void serve(OfLink& of_link, const Now& now);
  [[nodiscard]] const Topic* counting(const TopicKey& topic) const;

  const SideView& side_;
  std::map<LinkId, OfLink> links_;
  std::map<TopicKey, Topic> topics_;
  std::set<TopicKey> free_;  // of these: topics that are free
  std::set<TopicKey> changed_;
  std::optional<TimePoint> due_;  // when topics that wait for a place are checked again
};

}  // namespace connect_bridge
