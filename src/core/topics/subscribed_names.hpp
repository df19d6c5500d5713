// The names of the local topics that are subscribed.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

namespace connect_bridge {

class ExportedTopic;

// With some middlewares a process can use one type per topic name only: that of local endpoints, or
// that of the first listener at the other side. A topic that is subscribed for listeners alone
// keeps its name until a topic of the same name with publishers needs it. Single-threaded.
class SubscribedNames {
 public:
  // No other topic has the name.
  [[nodiscard]] bool are_free(const std::string& name, const ExportedTopic& topic) const;
  // The topic is subscribed from now on, for listeners alone or not. Returns the topic that must
  // end its subscription for it; null: none.
  [[nodiscard]] ExportedTopic* take(const std::string& name, ExportedTopic& topic, bool stands);
  void leave(const std::string& name, const ExportedTopic& topic);
  [[nodiscard]] std::vector<ExportedTopic*> standing() const;

 private:
  std::map<std::string, std::set<const ExportedTopic*>> taken_;
  std::map<std::string, ExportedTopic*> standing_;
};

}  // namespace connect_bridge
