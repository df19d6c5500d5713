// The local graph as rules and demand see it: real publishers and subscribers, without the bridges'
// own.
#pragma once

#include <map>
#include <set>
#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

#include "core/ports/inputs.hpp"

namespace connect_bridge {

// Every bridge publishes its claims on this hidden topic; a node that publishes there is a bridge.
inline constexpr char kClaimsTopic[] = "/_connect_bridge/claims";
inline constexpr char kClaimsType[] = "rcl_interfaces/msg/Log";

using TopicKey = std::pair<std::string, std::string>;  // name, type

using ServiceKey = std::pair<std::string, std::string>;

std::string node_of(const Server& server);
std::string node_of(const Endpoint& endpoint);  // "/namespace/name"; empty: not (yet) known

// The difference between two views. Without it, each node that starts would cost a look at all that
// peers have offered.
struct GraphDifference {
  bool all = true;               // anything may differ
  std::set<TopicKey> listened;   // topics with other subscribers
  std::set<Gid> publishers;      // new ones
  std::set<std::string> served;  // services that have a server now, or none any longer
};

// Built from one GraphChanged. Owns its data.
class GraphView {
 public:
  GraphView() = default;
  // `mirrors` has the same meaning as in hide().
  explicit GraphView(GraphChanged graph, const std::unordered_set<Gid>& mirrors = {});

  // The difference to an earlier view, without publishers that are gone.
  [[nodiscard]] GraphDifference since(const GraphView& before) const;

  // Publishers that were held back (LocalGraph), as topics with one publisher each; `mirrors` as
  // above.
  void add(std::vector<TopicState> publishers, const std::unordered_set<Gid>& mirrors);
  // Marks a publisher as local, though topics() does not show it yet.
  void add_local(const Gid& publisher) { publishers_.insert(publisher); }
  // Hides publishers that are other bridges' mirrors (Claims::mirrors). They are no real publishers
  // from now on, whatever their nodes and ids look like. True if one of them was.
  bool hide(const std::unordered_set<Gid>& mirrors);
  // Removes publishers that have left the graph.
  void remove(const std::unordered_set<Gid>& publishers);

  // Topics with at least one real endpoint.
  [[nodiscard]] const std::map<TopicKey, TopicState>& topics() const { return topics_; }
  [[nodiscard]] const TopicState* find(const TopicKey& key) const;
  [[nodiscard]] bool has_reliable_subscriber(const TopicKey& key) const;
  // The type of this topic cannot be taken here (TypeLack).
  [[nodiscard]] bool lacks_type_of(const TopicKey& key) const {
    const TopicState* topic = find(key);
    return topic && topic->lack;
  }
  // Services with at least one real server. Mirrors of other bridges are left out as far as the
  // graph shows them.
  [[nodiscard]] const std::map<ServiceKey, ServiceState>& services() const { return services_; }
  // Services that have a client here and no server, as far as the graph shows them.
  [[nodiscard]] const std::vector<CalledService>& called() const { return called_; }
  // A real server of this name exists here, whatever its type.
  [[nodiscard]] bool has_server(const std::string& service) const {
    const auto it = services_.lower_bound({service, ""});
    return it != services_.end() && it->first.first == service;
  }
  // A real publisher of the local graph has this id.
  [[nodiscard]] bool is_local(const Gid& gid) const { return publishers_.contains(gid); }
  // Publishers that belong to another bridge: their messages come from another graph.
  [[nodiscard]] const std::unordered_set<Gid>& bridge_publishers() const {
    return bridge_publishers_;
  }
  // Another bridge publishes this topic, and so brings it from another graph.
  [[nodiscard]] bool is_brought(const TopicKey& key) const { return brought_.contains(key); }
  // Publishers of the claims topic: the other bridges in this graph.
  [[nodiscard]] const std::unordered_set<Gid>& bridges() const { return bridges_; }

 private:
  std::map<TopicKey, TopicState> topics_;
  std::map<ServiceKey, ServiceState> services_;
  std::vector<CalledService> called_;
  std::unordered_set<Gid> publishers_;
  std::unordered_set<Gid> bridge_publishers_;
  std::set<TopicKey> brought_;
  std::unordered_set<Gid> bridges_;
};

// The policy that keeps a publisher with `offered` from serving a subscriber with `requested`:
// "reliability", "durability", "deadline" or "liveliness". Empty: they are compatible (DDS 1.4
// section 2.2.3).
std::string incompatible_policy(const Qos& offered, const Qos& requested);

// Such a policy in words of the ROS API, as far as it alone says it.
struct PolicyWords {
  std::string_view policy, requested, offered;
};
[[nodiscard]] PolicyWords words_of_policy(std::string_view policy);

// The policy that some subscriber requests and none of these publishers offers. Empty: there is
// none, or there are no publishers.
std::string unmet_policy(const TopicState& topic, const std::vector<Qos>& offered);

// The subscribers that receive nothing from a publisher of this QoS at this node.
struct IncompatibleSubscribers {
  std::vector<std::string> lines;  // for people, one for each subscriber
  bool unnamed = false;            // the name of another one, or the publisher's, is not known yet
};
// `patient`: an unknown name is waited for, and its line is left out until then.
IncompatibleSubscribers incompatible_subscribers(const TopicState& topic, const Qos& offered,
                                                 const std::string& node, bool patient);

}  // namespace connect_bridge
