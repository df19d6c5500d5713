#include "core/graph/graph_view.hpp"

#include <algorithm>
#include <iterator>

#include "core/graph/bridge_nodes.hpp"

namespace connect_bridge {

namespace {

std::string full_name(const std::string& ns, const std::string& name) {
  // "_NODE_NAME_UNKNOWN_" is the middlewares' name for a node of which they know only an endpoint
  // (rmw_dds_common).
  if (name.empty() || name == "_NODE_NAME_UNKNOWN_") return {};
  return (ns.empty() || ns == "/" ? std::string("/") : ns + "/") + name;
}

}  // namespace

std::string node_of(const Endpoint& endpoint) {
  return full_name(endpoint.node_namespace, endpoint.node_name);
}

std::string node_of(const Server& server) {
  return full_name(server.node_namespace, server.node_name);
}

GraphView::GraphView(GraphChanged graph, const std::unordered_set<Gid>& mirrors) {
  const BridgeNodes bridges(graph);
  for (auto& topic : graph.topics) {
    if (topic.name == kClaimsTopic) {
      for (const auto& publisher : topic.publishers) bridges_.insert(publisher.gid);
      continue;
    }
    if (!bridges.empty()) {
      const auto of_bridge = [&](const Endpoint& e) { return bridges.own(e); };
      for (const auto& publisher : topic.publishers) {
        if (!of_bridge(publisher)) continue;
        bridge_publishers_.insert(publisher.gid);
        brought_.insert({topic.name, topic.type});
      }
      std::erase_if(topic.publishers, of_bridge);
      std::erase_if(topic.subscribers, of_bridge);
    }
    if (topic.publishers.empty() && topic.subscribers.empty()) continue;
    for (const auto& publisher : topic.publishers) publishers_.insert(publisher.gid);
    TopicKey key{topic.name, topic.type};
    topics_.emplace(std::move(key), std::move(topic));
  }
  // A bridge's server that neither name nor id reveals is known by its claim (Claims::serves).
  for (auto& service : graph.services) {
    std::erase_if(service.servers, [&](const Server& s) { return bridges.own(s); });
    if (service.servers.empty()) continue;
    ServiceKey key{service.name, service.type};
    services_.emplace(std::move(key), std::move(service));
  }
  called_ = std::move(graph.called);
  hide(mirrors);
}

GraphDifference GraphView::since(const GraphView& before) const {
  GraphDifference difference{before.bridges_ != bridges_, {}, {}, {}};
  static const std::vector<Endpoint> none;
  const auto listeners = [](const GraphView& view, const TopicKey& key) -> const auto& {
    const TopicState* topic = view.find(key);
    return topic ? topic->subscribers : none;
  };
  for (const auto& [key, topic] : topics_)
    if (topic.subscribers != listeners(before, key)) difference.listened.insert(key);
  for (const auto& [key, topic] : before.topics_)
    if (topic.subscribers != listeners(*this, key)) difference.listened.insert(key);
  for (const Gid& gid : publishers_)
    if (!before.is_local(gid)) difference.publishers.insert(gid);
  for (const auto& [key, service] : services_)
    if (!before.has_server(key.first)) difference.served.insert(key.first);
  for (const auto& [key, service] : before.services_)
    if (!has_server(key.first)) difference.served.insert(key.first);
  return difference;
}

void GraphView::add(std::vector<TopicState> publishers, const std::unordered_set<Gid>& mirrors) {
  for (TopicState& added : publishers) {
    // The id counts, too: a peer that offers this publisher to this side makes a circle (is_local).
    publishers_.insert(added.publishers.front().gid);
    const auto [it, is_new] = topics_.try_emplace({added.name, added.type}, added);
    if (!is_new) it->second.publishers.push_back(std::move(added.publishers.front()));
  }
  hide(mirrors);
}

// Claims reveal mirrors that the graph does not: a mirror under a proxy node has another node's
// name, and some middlewares' ids do not identify the process.
bool GraphView::hide(const std::unordered_set<Gid>& mirrors) {
  const bool any = std::any_of(mirrors.begin(), mirrors.end(),
                               [&](const Gid& gid) { return publishers_.contains(gid); });
  if (!any) return false;
  for (const Gid& gid : mirrors)
    if (publishers_.contains(gid)) bridge_publishers_.insert(gid);
  for (const auto& [key, topic] : topics_)
    if (std::any_of(topic.publishers.begin(), topic.publishers.end(),
                    [&](const Endpoint& e) { return mirrors.contains(e.gid); }))
      brought_.insert(key);
  remove(mirrors);
  return true;
}

void GraphView::remove(const std::unordered_set<Gid>& publishers) {
  for (auto it = topics_.begin(); it != topics_.end();) {
    TopicState& topic = it->second;
    std::erase_if(topic.publishers, [&](const Endpoint& e) { return publishers.contains(e.gid); });
    const bool is_real = !topic.publishers.empty() || !topic.subscribers.empty();
    it = is_real ? std::next(it) : topics_.erase(it);
  }
  for (const Gid& gid : publishers) publishers_.erase(gid);
}

const TopicState* GraphView::find(const TopicKey& key) const {
  const auto it = topics_.find(key);
  return it == topics_.end() ? nullptr : &it->second;
}

bool GraphView::has_reliable_subscriber(const TopicKey& key) const {
  const TopicState* topic = find(key);
  return topic &&
         std::any_of(topic->subscribers.begin(), topic->subscribers.end(),
                     [](const auto& e) { return e.qos.reliability == Reliability::kReliable; });
}

std::string incompatible_policy(const Qos& offered, const Qos& requested) {
  if (offered.reliability == Reliability::kBestEffort &&
      requested.reliability == Reliability::kReliable)
    return "reliability";
  if (offered.durability == Durability::kVolatile &&
      requested.durability == Durability::kTransientLocal)
    return "durability";
  if (offered.deadline > requested.deadline) return "deadline";
  if (offered.liveliness == Liveliness::kAutomatic &&
      requested.liveliness == Liveliness::kManualByTopic)
    return "liveliness";
  if (offered.liveliness_lease > requested.liveliness_lease) return "liveliness lease";
  return {};
}

PolicyWords words_of_policy(std::string_view policy) {
  constexpr PolicyWords kWords[] = {
      {"reliability", "reliable", "best effort"},
      {"durability", "transient local", "volatile"},
      {"deadline", "a shorter deadline", "a longer one"},
      {"liveliness", "liveliness by topic", "automatic liveliness"},
      {"liveliness lease", "a shorter liveliness lease", "a longer one"},
  };
  for (const PolicyWords& words : kWords)
    if (words.policy == policy) return words;
  return {policy, policy, "another one"};
}

std::string unmet_policy(const TopicState& topic, const std::vector<Qos>& offered) {
  for (const Endpoint& subscriber : topic.subscribers) {
    std::string policy;
    for (const Qos& qos : offered) {
      policy = incompatible_policy(qos, subscriber.qos);
      if (policy.empty()) break;
    }
    if (!policy.empty()) return policy;
  }
  return {};
}

IncompatibleSubscribers incompatible_subscribers(const TopicState& topic, const Qos& offered,
                                                 const std::string& node, bool patient) {
  IncompatibleSubscribers found;
  for (const auto& subscriber : topic.subscribers) {
    const std::string policy = incompatible_policy(offered, subscriber.qos);
    if (policy.empty()) continue;
    const std::string name = node_of(subscriber);
    // A line is logged once for each pair of names, so it waits for both: a second line with a name
    // would be a different line.
    if (patient && (name.empty() || node.empty())) {
      found.unnamed = true;
      continue;
    }
    const PolicyWords words = words_of_policy(policy);
    found.lines.push_back(topic.name + ": " + (name.empty() ? "a subscriber here" : name) +
                          " requests " + std::string(words.requested) + ", and " +
                          (node.empty() ? "a publisher" : node) + " on the other side offers " +
                          std::string(words.offered) + " (QoS " + policy +
                          "): it receives nothing from it");
  }
  return found;
}

}  // namespace connect_bridge
