// State that the real services here and the links attached to them share.
#pragma once

#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "core/base/budget.hpp"
#include "core/base/random.hpp"
#include "core/base/timers.hpp"
#include "core/graph/side_view.hpp"
#include "core/link/link.hpp"
#include "core/services/call_gate.hpp"
#include "core/services/options.hpp"

namespace connect_bridge {

class Attachment;
class RealService;
class ServedCall;

// The budgets of the calls of one peer, for all services together.
struct ServedLoad {
  explicit ServedLoad(Budget& memory) : request_bytes(&memory), answer_bytes(&memory) {}

  Budget calls;
  Budget request_bytes;  // of calls that wait
  Budget answer_bytes;   // of answers that are not known to have arrived
};

// Peers can send goals to this action from now on, or can no longer.
struct ActionUse {
  std::string action;  // local name
  bool on = false;
};

// What the services share; outlives them. Single-threaded.
struct Serving : SideView {
  // A deadline of a call; if `call` is not set, of an attachment that the peer has not attached
  // again.
  struct Due {
    Attachment* attachment = nullptr;
    ServedCall* call = nullptr;
  };

  const ServiceOptions& options;
  Random& random;

  CallGate gate{};
  Timers<Due> timers{};
  std::map<LinkId, ServedLoad> loads{};
  std::unordered_map<ServiceClientId, RealService*> by_client{};
  std::vector<ActionUse> action_uses{};  // changes that were not taken yet

  // Begins the calls whose turn it is. To be called after everything that may free a place.
  void begin_calls(const Now& now);
};

}  // namespace connect_bridge
