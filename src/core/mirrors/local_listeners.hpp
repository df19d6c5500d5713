// Reports the subscribed topics of this side's graph to peers.
#pragma once

#include <cstdint>
#include <map>

#include "core/graph/side_view.hpp"
#include "core/link/link.hpp"

namespace connect_bridge {

// Reports the topics that have a subscription here and that our rules let the peer publish. The
// peer need not offer them: after the report the topic exists there, too. Each link gets the
// changes since the last report, and all on a new connection. Endpoints of bridges are not
// listeners (GraphView does not contain them). Single-threaded.
class LocalListeners {
 public:
  explicit LocalListeners(const SideView& side) : side_(side) {}

  // Sends the changes. Called when the graph has changed, or the open link has no report yet.
  void tell(Link& link);
  // Our rules or the link's identity have changed.
  void recheck(Link& link);
  void on_link_lost(LinkId link) { links_.erase(link); }

 private:
  struct Reported {
    std::map<TopicKey, bool> permitted;  // of the topics that were checked
    std::map<TopicKey, ListenerId> listeners;
    std::uint32_t last = 0;
  };

  [[nodiscard]] bool permits(Reported& reported, const Link& link, const TopicKey& topic) const;

  const SideView side_;
  std::map<LinkId, Reported> links_;
};

}  // namespace connect_bridge
