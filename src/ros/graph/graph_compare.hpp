// Whether two readings of the graph are equal.
#pragma once

#include <algorithm>
#include <vector>

#include "core/ports/ports.hpp"

namespace connect_bridge::ros {

inline bool same_endpoints(const std::vector<Endpoint>& a, const std::vector<Endpoint>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const Endpoint& x, const Endpoint& y) {
                      return x.gid == y.gid && x.node_name == y.node_name &&
                             x.node_namespace == y.node_namespace && x.qos == y.qos;
                    });
}

inline bool same_topics(const std::vector<TopicState>& a, const std::vector<TopicState>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const TopicState& x, const TopicState& y) {
                      return x.name == y.name && x.type == y.type && x.type_hash == y.type_hash &&
                             same_endpoints(x.publishers, y.publishers) &&
                             same_endpoints(x.subscribers, y.subscribers);
                    });
}

inline bool same_services(const std::vector<ServiceState>& a, const std::vector<ServiceState>& b) {
  const auto same_server = [](const Server& x, const Server& y) {
    return x.gid == y.gid && x.node_name == y.node_name && x.node_namespace == y.node_namespace;
  };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [&](const ServiceState& x, const ServiceState& y) {
                      return x.name == y.name && x.type == y.type &&
                             std::equal(x.servers.begin(), x.servers.end(), y.servers.begin(),
                                        y.servers.end(), same_server);
                    });
}

inline bool same_graph(const GraphChanged& a, const GraphChanged& b) {
  return same_topics(a.topics, b.topics) && same_services(a.services, b.services);
}

}  // namespace connect_bridge::ros
