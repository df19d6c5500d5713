#include "core/services/serving.hpp"

#include "core/services/real_service.hpp"

namespace connect_bridge {

void Serving::begin_calls(const Now& now) {
  while (const auto next = gate.next(now.steady)) {
    const auto service = by_client.find(next->caller.service);
    if (service != by_client.end()) service->second->begin(next->caller.link, next->call, now);
  }
}

}  // namespace connect_bridge
