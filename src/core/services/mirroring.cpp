#include "core/services/mirroring.hpp"

#include "core/policy/interface.hpp"
#include "core/services/mirrored_service.hpp"

namespace connect_bridge {

Mirroring::~Mirroring() = default;

void Mirroring::update(MirroredService& service, const Now& now) {
  // With the link that the goals of an action go to, its cancels and results move too: a cancel
  // that goes to another robot stops nothing. This ends, because only a service of goals begins it,
  // and reports each move once. The name is asked for before the service may be destroyed.
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

// Each of these loops takes its next element first, as an update may destroy its service. It may
// update others of its action, too, but destroys none of them: a service is updated at once when
// its last feed has gone, so each other one still has feeds.
void Mirroring::update_all(const Now& now) {
  for (auto it = services.begin(); it != services.end();) update(*(it++)->second, now);
}

void Mirroring::update_due(const Now& now) {
  // It is collected again: update() notes what still has to wait by itself.
  settles_at.reset();
  for (auto it = services.begin(); it != services.end();) {
    MirroredService& service = *(it++)->second;
    const auto due = service.due();
    if (due && *due <= now.steady) {
      update(service, now);
    } else {
      settles_at = earliest(settles_at, due);
    }
  }
}

}  // namespace connect_bridge
