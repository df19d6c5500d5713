// Reports the subscriptions in this side's graph to its peers.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/graph/side_view.hpp"
#include "core/link/link.hpp"

namespace connect_bridge {

// A peer gets the listeners here to topics that our rules let it publish, whether it offers them or
// not: then the topic exists there, too. Each link gets the changes since the last time, and all
// listeners on a new connection. Endpoints of bridges are not listeners (GraphView does not contain
// them). Single-threaded.
class ToldListeners {
 public:
  explicit ToldListeners(const SideView& side) : side_(side) {}

  // The graph has changed, or the link is open and has not got the listeners yet.
  void tell(Link& link);
  // Our rules or the link's identity have changed.
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
    std::map<TopicKey, bool> permitted;  // of the topics that were checked
    std::map<Key, Listener> listeners;
    std::uint32_t last = 0;
  };

  [[nodiscard]] bool permits(Told& told, const Link& link, const TopicKey& topic) const;
  // The listeners here that this link may know of.
  [[nodiscard]] std::map<Key, Listener> listeners_for(Told& told, const Link& link) const;

  const SideView side_;
  std::map<LinkId, Told> links_;
};

}  // namespace connect_bridge
