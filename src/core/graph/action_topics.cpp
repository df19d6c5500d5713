#include "core/graph/action_topics.hpp"

#include <algorithm>

#include "core/policy/interface.hpp"

namespace connect_bridge {

namespace {

std::string action_of(const std::string& topic) {
  return topic.substr(0, topic.rfind("/_action/"));
}

}  // namespace

void ActionTopics::set(const std::string& topic, MirrorId mirror, bool feeds) {
  const auto [it, is_new] = topics_[topic].try_emplace(mirror, feeds);
  // Only real changes are told: each makes the services of the action be looked at again.
  if (!is_new && it->second == feeds) return;
  it->second = feeds;
  changed_.insert(action_of(topic));
}

void ActionTopics::remove(const std::string& topic, MirrorId mirror) {
  const auto it = topics_.find(topic);
  if (it == topics_.end() || it->second.erase(mirror) == 0) return;
  changed_.insert(action_of(topic));
  if (it->second.empty()) topics_.erase(it);
}

bool ActionTopics::all(const std::string& action, bool feed) const {
  // Servers of one action's name have a publisher each, so a topic may have several mirrors: one is
  // enough.
  const auto holds = [&](ActionPart part) {
    const auto it = topics_.find(name_of_part(action, part));
    if (it == topics_.end()) return false;
    return !feed || std::any_of(it->second.begin(), it->second.end(),
                                [](const auto& mirror) { return mirror.second; });
  };
  return holds(ActionPart::kFeedback) && holds(ActionPart::kStatus);
}

}  // namespace connect_bridge
