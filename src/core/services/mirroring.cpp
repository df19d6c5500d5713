#include "core/services/mirroring.hpp"

#include "core/policy/interface.hpp"
#include "core/services/mirrored_service.hpp"

namespace connect_bridge {

Mirroring::~Mirroring() = default;

void Mirroring::update(MirroredService& service, const Now& now) {
  const bool stays = service.update(now);
  const std::string moved = service.take_goals_move() || !stays ? service.goals_of() : "";
  if (!stays) {
    const ServiceKey key = service.key();
    services.erase(key);
  }
  if (!moved.empty()) update_action(moved, now);
}

void Mirroring::update_action(const std::string& action, const Now& now) {
  for (const ActionPart part : kActionParts) {
    if (kind_of(part) != InterfaceKind::kService) continue;
    const std::string name = name_of_part(action, part);
    for (auto it = services.lower_bound({name, ""});
         it != services.end() && it->first.first == name;)
      update(*(it++)->second, now);
  }
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
