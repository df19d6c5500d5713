// Limits and budgets of calls, for served calls and made calls alike.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "core/base/budget.hpp"
#include "core/base/ids.hpp"
#include "core/base/log_limit.hpp"
#include "core/base/time.hpp"
#include "core/flow/channel_queue.hpp"
#include "core/graph/graph_view.hpp"
#include "core/policy/policy.hpp"
#include "core/ports/outputs.hpp"

namespace connect_bridge {

// Unanswered calls of all services that one peer may have, whatever the rules grant.
inline constexpr std::uint32_t kPeerCallsMax = 8192;
// Unanswered calls of one peer at one service that returns results of actions.
inline constexpr std::uint32_t kResultCallsMax = 1000;
// The largest request for a result that is made again after a break; a goal's id has 20 bytes.
inline constexpr std::size_t kResultRequestMax = 64;
// The upper limit of call numbers; an exporter begins a new epoch long before.
inline constexpr std::uint32_t kCallNumbersMax = 0xF0000000;

// Bytes of requests and answers together that may wait in a link's outbox, including those of calls
// that were given up.
[[nodiscard]] constexpr std::uint64_t kept_bytes_max(std::uint64_t call_bytes_max) {
  return 2 * (call_bytes_max + kPeerCallsMax * kKeptMessageBytes);
}

// The budgets of the calls of one link, for all services together.
struct CallLoad {
  explicit CallLoad(Budget& memory) : request_bytes(&memory), answer_bytes(&memory) {}

  Budget calls;
  Budget waiting;        // served calls that wait for their turn
  Budget request_bytes;  // served: requests that wait; made: requests not known to have arrived
  Budget answer_bytes;   // served: answers not known to have arrived; made: in decompression
};
using CallLoads = std::map<LinkId, CallLoad>;

[[nodiscard]] inline std::uint64_t bytes_of(const CallLoads& loads) {
  std::uint64_t bytes = 0;
  for (const auto& [link, load] : loads)
    bytes += load.request_bytes.used() + load.answer_bytes.used();
  return bytes;
}

// True for a service that returns an action's results: such calls last as long as the goal.
[[nodiscard]] inline bool is_result_service(const std::string& name) {
  return name.ends_with("/_action/get_result");
}

// Queue options for requests and answers: none may be dropped.
[[nodiscard]] inline QueueOptions queue_of_calls(const Decision& decision) {
  QueueOptions queue;
  queue.priority = decision.treatment.priority.value_or(Priority::kHigh);
  queue.may_be_light = !decision.treatment.priority;
  queue.keep = true;  // mutant: calls_kept
  if (decision.treatment.compression.automatic) queue.compression = decision.treatment.compression;
  return queue;
}

// Logs "3 call(s) refused, last one of /add: too many" at a limited rate.
inline void log_calls(Outputs& outputs, LogLimit& limit, const std::string& what,
                      const ServiceKey& service, const std::string& why, const Now& now,
                      std::uint64_t calls = 1) {
  if (calls == 0) return;
  if (const auto count = limit.count(now, calls))
    outputs.log(LogLevel::kWarn, std::to_string(*count) + " call(s) " + what + ", last one of " +
                                     service.first + (why.empty() ? "" : ": " + why));
}

}  // namespace connect_bridge
