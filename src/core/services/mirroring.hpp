// State that the mirrored services here and their feeds share.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>

#include "core/base/budget.hpp"
#include "core/base/timers.hpp"
#include "core/graph/side_view.hpp"
#include "core/link/link.hpp"
#include "core/services/options.hpp"

namespace connect_bridge {

class MadeCall;
class MirroredService;

// The budgets of the calls to one peer, for all services together.
struct MadeLoad {
  explicit MadeLoad(Budget& memory) : request_bytes(&memory), decoding_bytes(&memory) {}

  Budget calls;
  Budget request_bytes;   // of requests that are not known to have arrived
  Budget decoding_bytes;  // of answers
};

// Owns the mirrored services, and what they share. Single-threaded.
struct Mirroring : SideView {
  const ServiceOptions& options;
  const std::string& own_node;

  Timers<MadeCall*> timers{};
  std::map<LinkId, MadeLoad> loads{};
  std::map<ServiceKey, std::unique_ptr<MirroredService>> services{};
  std::unordered_map<ServiceMirrorId, MirroredService*> by_mirror{};
  std::optional<TimePoint> graph_since{};  // of the first graph; no mirror right after it
  std::optional<TimePoint> settles_at{};   // when the first claim without a mirror has settled

  ~Mirroring();
  // Updates the service (MirroredService::update); one that nobody offers any longer is destroyed.
  // With the link that an action's goals go to, its other services change.
  void update(MirroredService& service, const Now& now);
  // Updates the services of an action (local name).
  void update_action(const std::string& action, const Now& now);
  void update_all(const Now& now);
  // Updates those whose mirror is due.
  void update_due(const Now& now);
};

}  // namespace connect_bridge
