#include "core/graph/actions.hpp"

#include <algorithm>
#include <utility>

// Actions are found by their service for goals, whose type contains the action's type. Names and
// types of the other parts follow from it. An action is whole if all its parts exist: it is ready
// as a whole or not at all (docs/protocol.md section 9.11, rule 3).
namespace connect_bridge {

std::vector<std::string> LocalActions::update(const GraphView& graph, const Claims& claims) {
  std::map<std::string, std::string> whole;
  lacked_.clear();
  for (const auto& [key, service] : graph.services()) {
    const auto goal = part_of_action(InterfaceKind::kService, key.first, key.second);
    if (!goal || goal->part != ActionPart::kSendGoal) continue;
    const TypeLack* lack = nullptr;
    const auto exists = [&](ActionPart part) {
      const std::string name = name_of_part(goal->action, part);
      const std::string type = type_of_part(goal->action_type, part);
      if (kind_of(part) == InterfaceKind::kService) {
        const auto found = graph.services().find({name, type});
        // A mirror of another bridge is no server of this graph, whatever its node is called.
        if (found == graph.services().end() || claims.serves(service_gid(name))) return false;
        if (found->second.lack && !lack) lack = &*found->second.lack;
        return true;
      }
      const TopicState* topic = graph.find({name, type});
      if (!topic || topic->publishers.empty()) return false;
      if (topic->lack && !lack) lack = &*topic->lack;
      return true;
    };
    if (!std::all_of(kActionParts.begin(), kActionParts.end(), exists)) continue;
    // All parts exist, but one cannot be taken here. No part is offered, and peers are informed
    // (TypeLacks).
    if (lack) {
      lacked_.emplace(goal->action, LackedAction{std::string(goal->action_type), *lack});
    } else {
      whole.emplace(goal->action, goal->action_type);
    }
  }
  std::vector<std::string> changed;
  const auto note_others = [&](const auto& ones, const auto& others) {
    for (const auto& [name, type] : ones) {
      const auto other = others.find(name);
      if (other == others.end() || other->second != type) changed.push_back(name);
    }
  };
  note_others(whole, types_);
  note_others(types_, whole);
  types_ = std::move(whole);
  return changed;
}

std::optional<std::string> LocalActions::type_of(InterfaceKind kind, const std::string& name,
                                                 const std::string& type) const {
  if (!has_action_token(name)) return std::string{};
  const auto part = part_of_action(kind, name, type);
  const auto action = part ? types_.find(std::string(part->action)) : types_.end();
  if (action == types_.end()) return std::nullopt;
  // The action of this name is whole, but may have another type than this part.
  if (type_of_part(action->second, part->part) != type) return std::nullopt;
  return action->second;
}

}  // namespace connect_bridge
