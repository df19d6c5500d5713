// The listeners at the other side of the links.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "core/graph/side_view.hpp"
#include "core/link/link.hpp"
#include "core/topics/options.hpp"

namespace connect_bridge {

// The peers' nodes that listen to topics of ours, as reported in `listeners` messages. A listener
// counts while our rules and the peer's `accepts` allow the peer its topic; others are kept until
// they do. With proxy nodes a listener is shown as a subscription under its node's name while its
// topic is subscribed; no samples are taken from that subscription, but from the topic's own.
// Single-threaded.
class FarListeners {
 public:
  // Both outlive this.
  FarListeners(const SideView& side, const TopicOptions& options)
      : side_(side), options_(options) {}
  FarListeners(const FarListeners&) = delete;
  FarListeners& operator=(const FarListeners&) = delete;

  // Beyond a pace (Account::listeners), beyond TopicOptions::listeners_max, and beyond what its
  // identity may make this side hold, what is new counts later, see on_time().
  // An error ends the connection: a number in use, too many, or changes without end.
  Result<Nothing> on_listeners(Link& link, const Listeners& change, const Now& now);
  // Our rules, the link's identity or the peer's `accepts` have changed.
  void review(const Link& link, const Now& now);
  void on_link_lost(LinkId link);
  // Counts listeners that had exceeded the rate.
  void on_time(const Now& now);
  [[nodiscard]] std::optional<TimePoint> deadline() const { return due_; }

  // The topics whose listeners came or went since the last call.
  std::set<TopicKey> take_changes() { return std::exchange(changed_, {}); }
  [[nodiscard]] bool listens(const TopicKey& topic) const { return topics_.contains(topic); }
  [[nodiscard]] bool listens(const TopicKey& topic, LinkId link) const;
  // The weakest of what our rules require for those links that listen and `count`: reliability and
  // durability.
  [[nodiscard]] QosOverride rules_of(const TopicKey& topic,
                                     const std::function<bool(LinkId)>& count) const;
  // Where to note what is logged once about a topic that only listeners have: what their peers make
  // this side say must not keep other lines out.
  [[nodiscard]] TellOnce& told_of(const TopicKey& topic) const;
  // The type hash that the listeners reported; empty: none.
  [[nodiscard]] std::string type_hash_of(const TopicKey& topic) const;

  // The topic is subscribed, or not any longer: shows or hides its listeners in the graph.
  void show(const TopicKey& topic, bool on);

 private:
  struct Listener {
    ListenerTold told;
    std::optional<TopicKey> topic;  // local name; none: not one that the peer can have
    bool permitted = false;
    QosOverride rule;  // while it is permitted
    bool counts = false;
    bool waits = false;  // it is allowed, and does not count yet
    Budget::Hold held;   // while it counts
    SubscriptionId shown;
  };
  using Key = std::pair<LinkId, ListenerId>;
  struct Topic {
    std::map<Key, Listener*> listeners;  // that count
    bool shown = false;
  };
  struct OfLink {
    Link* link = nullptr;
    std::map<ListenerId, Listener> listeners;
    std::uint32_t counting = 0;  // of these
  };

  void add(const Link& link, const ListenerTold& told, const Now& now);
  void decide(const Link& link, Listener& listener) const;
  // Counts the listener if it is allowed, now or later.
  void admit(Key key, Listener& listener, const Now& now);
  // Zero: it may be subscribed for now; else when to ask again.
  [[nodiscard]] Duration wait_to_count(const OfLink& of_link, const TopicKey& topic,
                                       const Now& now);
  // Whether listeners of this identity count for so many other types of the name as may be.
  [[nodiscard]] bool has_too_many_types(const Account& account, const TopicKey& topic) const;
  void set(Key key, Listener& listener, bool counts);
  void show(Listener& listener, bool on);

  const SideView& side_;
  const TopicOptions& options_;
  std::map<LinkId, OfLink> links_;
  std::map<TopicKey, Topic> topics_;
  std::set<TopicKey> changed_;
  std::optional<TimePoint> due_;  // some are allowed and do not count yet
};

}  // namespace connect_bridge
