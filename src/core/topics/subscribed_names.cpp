#include "core/topics/subscribed_names.hpp"

namespace connect_bridge {

bool SubscribedNames::are_free(const std::string& name, const ExportedTopic& topic) const {
  const auto taken = taken_.find(name);
  return taken == taken_.end() || (taken->second.size() == 1 && taken->second.contains(&topic));
}

ExportedTopic* SubscribedNames::take(const std::string& name, ExportedTopic& topic, bool stands) {
  taken_[name].insert(&topic);
  // A topic with publishers never gives way, so several types of a name may be subscribed for
  // those. What stands for listeners alone gives way to them: the caller ends it.
  if (stands) {
    standing_[name] = &topic;
    return nullptr;
  }
  const auto standing = standing_.find(name);
  if (standing == standing_.end()) return nullptr;
  if (standing->second != &topic) return standing->second;
  standing_.erase(standing);
  return nullptr;
}

void SubscribedNames::leave(const std::string& name, const ExportedTopic& topic) {
  const auto standing = standing_.find(name);
  if (standing != standing_.end() && standing->second == &topic) standing_.erase(standing);
  const auto taken = taken_.find(name);
  if (taken == taken_.end()) return;
  taken->second.erase(&topic);
  if (taken->second.empty()) taken_.erase(taken);
}

std::vector<ExportedTopic*> SubscribedNames::standing() const {
  std::vector<ExportedTopic*> topics;
  for (const auto& [name, topic] : standing_) topics.push_back(topic);
  return topics;
}

}  // namespace connect_bridge
