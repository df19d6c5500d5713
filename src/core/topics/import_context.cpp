#include "core/topics/import_context.hpp"

#include "core/policy/interface.hpp"

namespace connect_bridge {

Mirror* ImportContext::mirror_of(const MirrorKey& key) {
  if (mirrors.size() >= options.mirrors_max && !mirrors.contains(key)) return nullptr;
  return &mirrors.try_emplace(key, *this, key).first->second;
}

void ImportContext::remove_candidate(Mirror& mirror, LinkId link, const Now& now) {
  mirror.remove_candidate(link, now);
  if (mirror.is_over()) mirrors.erase(MirrorKey(mirror.key()));
}

std::optional<Decision> ImportContext::permission(const Link& link, const std::string& wire_name,
                                                  const std::string& type,
                                                  const std::string& action_type) const {
  if (is_parameter_events(InterfaceKind::kTopic, wire_name))
    return policy.decide_parameter_events(Direction::kImport, link.identity);
  return policy.decide(Direction::kImport, {InterfaceKind::kTopic, wire_name, type, action_type},
                       link.identity);
}

std::optional<Decision> ImportContext::permission(const Link& link, const TopicKey& key,
                                                  const std::string& action_type) const {
  const auto wire_name = graph_options.names.to_wire(key.first);
  if (!wire_name) return std::nullopt;
  return permission(link, *wire_name, key.second, action_type);
}

}  // namespace connect_bridge
