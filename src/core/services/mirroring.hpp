// What the mirrors of services here and the links that feed them share.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>

#include "core/base/budget.hpp"
#include "core/base/log_limit.hpp"
#include "core/base/timers.hpp"
#include "core/graph/claims.hpp"
#include "core/graph/graph_view.hpp"
#include "core/graph/options.hpp"
#include "core/jobs/jobs.hpp"
#include "core/link/link.hpp"
#include "core/ports/outputs.hpp"
#include "core/services/options.hpp"

namespace connect_bridge {

class MadeCall;
class MirroredService;

// What the calls to one peer take, all services together.
struct MadeLoad {
  explicit MadeLoad(Budget& memory) : request_bytes(&memory), decoding_bytes(&memory) {}

  Budget calls;
  Budget request_bytes;   // not known to have arrived
  Budget decoding_bytes;  // of answers
  LogLimit refusals, timeouts;
};

// Owns the mirrored services, which find here whatever they do not own. Single-threaded.
struct Mirroring {
  const ServiceOptions& options;
  const GraphOptions& graph_options;
  const std::string& own_node;
  const Policy& policy;
  const GraphView& graph;
  const Claims& claims;
  Jobs& jobs;
  Outputs& outputs;

  Timers<MadeCall*> timers;
  std::map<LinkId, MadeLoad> loads;
  std::map<ServiceKey, std::unique_ptr<MirroredService>> services;
  std::unordered_map<ServiceMirrorId, MirroredService*> by_mirror{};
  std::optional<TimePoint> graph_since{};  // no mirror before the local graph has been discovered
  std::optional<TimePoint> settles_at{};   // when the first claim without a mirror has settled
  bool claim_changed = false;

  ~Mirroring();
  // Does what follows for the service from what is known now; one that nobody offers any longer is
  // destroyed.
  void update(MirroredService& service, const Now& now);
  void update_all(const Now& now);
};

}  // namespace connect_bridge
