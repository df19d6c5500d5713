// What this side tells its peers of the subscriptions in its graph.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/graph/graph_view.hpp"
#include "core/graph/options.hpp"
#include "core/link/link.hpp"
#include "core/ports/outputs.hpp"

namespace connect_bridge {

// A peer is told of who listens here to what our rules let it send, whether it offers that or not:
// then the topic exists there, too. Each link gets what is new since the last time, and all of it
// on a new connection. What belongs to a bridge is no listener (GraphView has none of it).
// Single-threaded.
class ToldListeners {
 public:
  // All outlive this.
  ToldListeners(const GraphOptions& options, const Policy& policy, const GraphView& graph,
                Outputs& outputs)
      : options_(options), policy_(policy), graph_(graph), outputs_(outputs) {}

  // The graph is new, or the link is open and was not told before.
  void tell(Link& link);
  // Our rules or the link's identity are new.
  void recheck(Link& link);
  void on_link_lost(LinkId link) { links_.erase(link); }

 private:
  using Key = std::pair<TopicKey, std::string>;  // local topic, node on the wire
  struct Listener {
    ListenerId id;
    std::string type_hash;
    Qos qos;
  };
  struct Told {
    std::map<TopicKey, bool> permitted;  // of the topics that were looked at
    std::map<Key, Listener> listeners;
    std::uint32_t last = 0;
  };

  [[nodiscard]] bool permits(Told& told, const Link& link, const TopicKey& topic) const;
  // Who listens here, as this link may know it.
  [[nodiscard]] std::map<Key, Listener> listeners_for(Told& told, const Link& link) const;
  static void send(Link& link, Listeners change);

  const GraphOptions& options_;
  const Policy& policy_;
  const GraphView& graph_;
  Outputs& outputs_;
  std::map<LinkId, Told> links_;
};

}  // namespace connect_bridge
