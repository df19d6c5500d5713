// The names of the local topics that are subscribed.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

namespace connect_bridge {

class ExportedTopic;

// With some middlewares a process can have one type of a name only: that of who is here, or of who
// listened first at the other side. Who is subscribed for listeners alone stands until a topic of
// its name that has publishers wants its place. Single-threaded.
class SubscribedNames {
 public:
  // No other topic has the name.
  [[nodiscard]] bool are_free(const std::string& name, const ExportedTopic& topic) const;
  // The topic is subscribed from now on, for listeners alone or not. Returns who has to give way.
  [[nodiscard]] ExportedTopic* take(const std::string& name, ExportedTopic& topic, bool stands);
  void leave(const std::string& name, const ExportedTopic& topic);
  [[nodiscard]] std::vector<ExportedTopic*> standing() const;

 private:
  std::map<std::string, std::set<const ExportedTopic*>> taken_;
  std::map<std::string, ExportedTopic*> standing_;
};

}  // namespace connect_bridge
