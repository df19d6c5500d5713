#include "core/services/mirroring.hpp"

#include "core/services/mirrored_service.hpp"

namespace connect_bridge {

Mirroring::~Mirroring() = default;

void Mirroring::update(MirroredService& service, const Now& now) {
  if (service.update(now)) return;
  const ServiceKey key = service.key();
  services.erase(key);
}

void Mirroring::update_all(const Now& now) {
  for (auto it = services.begin(); it != services.end();) update(*(it++)->second, now);
}

void Mirroring::update_due(const Now& now) {
  settles_at.reset();
  for (auto it = services.begin(); it != services.end();) {
    MirroredService& service = *(it++)->second;
    const auto due = service.due(now);
    if (due && *due <= now.steady) {
      update(service, now);
    } else {
      settles_at = earliest(settles_at, due);
    }
  }
}

}  // namespace connect_bridge
