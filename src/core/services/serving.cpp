#include "core/services/serving.hpp"

#include "core/services/real_service.hpp"

namespace connect_bridge {

void Serving::begin_calls(const Now& now) {
  // One at a time: to begin a call may end it, and so may free places or end others that would have
  // been next.
  while (const auto next = gate.next(now.steady)) {
    const auto service = by_client.find(next->caller.service);
    if (service != by_client.end()) service->second->begin(next->caller.link, next->call, now);
  }
}

}  // namespace connect_bridge
