// State that the exported topics of a side share.
#pragma once

#include <map>
#include <set>
#include <string>
#include <unordered_map>

#include "core/base/budget.hpp"
#include "core/graph/actions.hpp"
#include "core/graph/graph_view.hpp"
#include "core/graph/options.hpp"
#include "core/jobs/jobs.hpp"
#include "core/topics/backlog.hpp"
#include "core/topics/far_listeners.hpp"
#include "core/topics/options.hpp"
#include "core/topics/origins.hpp"
#include "core/topics/subscribed_names.hpp"

namespace connect_bridge {

struct ExportContext {
  const TopicOptions& options;
  const GraphOptions& graph_options;
  const Policy& policy;
  const GraphView& graph;
  const LocalActions& actions;
  Jobs& jobs;
  Outputs& outputs;
  Budget memory{};  // local samples kept for links that come later

  std::set<std::string> held{};  // names of topics that are subscribed without demand
  std::unordered_map<SubscriptionId, ExportedTopic*> by_subscription{};
  Budget parked{};                       // samples whose publishers are not known yet
  Budget early{&memory};                 // samples that wait for the answer to an offer
  std::map<LinkId, LinkBacklog> kept{};  // of links that are lost
  ExportTimers timers{};
  FarListeners listeners{graph_options, options, policy, outputs};
  SubscribedNames names{};
};

}  // namespace connect_bridge
