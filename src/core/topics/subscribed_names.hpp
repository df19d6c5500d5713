// The names of the local topics that are subscribed.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

namespace connect_bridge {

class LocalTopic;

// Some middlewares let a process use only one type per topic name. The type is that of local
// endpoints, or that of the first listener at the other side. A topic that is subscribed for
// listeners alone keeps its name until a topic of the same name with publishers needs it.
// Single-threaded.
class SubscribedNames {
 public:
  // No other topic has the name.
  [[nodiscard]] bool are_free(const std::string& name, const LocalTopic& topic) const {
    const auto taken = taken_.find(name);
    return taken == taken_.end() || (taken->second.size() == 1 && taken->second.contains(&topic));
  }
  // The topic is subscribed from now on; `stands`: for listeners alone. Returns the topic that must
  // end its subscription for it; null: none.
  [[nodiscard]] LocalTopic* take(const std::string& name, LocalTopic& topic, bool stands) {
    taken_[name].insert(&topic);
    // A topic with publishers never gives way, so several types of a name may be subscribed. A
    // topic that stands for listeners alone gives way to them: the caller ends its subscription.
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
  void leave(const std::string& name, const LocalTopic& topic) {
    const auto standing = standing_.find(name);
    if (standing != standing_.end() && standing->second == &topic) standing_.erase(standing);
    const auto taken = taken_.find(name);
    if (taken == taken_.end()) return;
    taken->second.erase(&topic);
    if (taken->second.empty()) taken_.erase(taken);
  }
  [[nodiscard]] std::vector<LocalTopic*> standing() const {
    std::vector<LocalTopic*> topics;
    for (const auto& [name, topic] : standing_) topics.push_back(topic);
    return topics;
  }

 private:
  std::map<std::string, std::set<const LocalTopic*>> taken_;
  std::map<std::string, LocalTopic*> standing_;
};

}  // namespace connect_bridge
