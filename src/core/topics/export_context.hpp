// State that the local topics of a side share.
#pragma once

#include <chrono>
#include <map>
#include <set>
#include <string>
#include <unordered_map>

#include "core/base/budget.hpp"
#include "core/base/pace.hpp"
#include "core/graph/side_view.hpp"
#include "core/topics/backlog.hpp"
#include "core/topics/options.hpp"
#include "core/topics/origins.hpp"
#include "core/topics/peer_listeners.hpp"
#include "core/topics/subscribed_names.hpp"

namespace connect_bridge {

struct ExportContext : SideView {
  const TopicOptions& options;
  Budget memory{};  // local samples kept for links that come later

  std::set<std::string> held{};  // names of topics that are subscribed without demand
  std::unordered_map<SubscriptionId, LocalTopic*> by_subscription{};
  Budget parked{};                       // samples whose publishers are not known yet
  Budget early{&memory};                 // samples that wait for the answer to an offer
  std::map<LinkId, LinkBacklog> kept{};  // backlogs of lost links
  DroppedMessages dropped{};             // of backlogs
  ExportTimers timers{};
  PeerListeners listeners{*this};
  SubscribedNames names{};
  Pace subscriptions{10, std::chrono::milliseconds(1)};  // paces new subscriptions
  // Rights change for one link after the other. No subscription is made meanwhile: the link that
  // needs it may lose the right next.
  bool reviewing = false;
  std::set<TopicKey> postponed{};  // topics that need another subscription after the review
  std::set<TopicKey> news{};       // topics that may be due at links that had no offer of them

  // Is this publisher another bridge's mirror? Our view of the graph does not show a bridge with
  // our node's name, but its claim does.
  [[nodiscard]] bool is_of_bridge(const Gid& publisher) const {
    return graph.bridge_publishers().contains(publisher) || claims.mirrors().contains(publisher);
  }
};

}  // namespace connect_bridge
