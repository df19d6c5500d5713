// Which topics of actions have mirrors here: the services of an action follow them.
#pragma once

#include <map>
#include <set>
#include <string>
#include <utility>

#include "core/base/ids.hpp"

namespace connect_bridge {

// Local names. Single-threaded; owned by the side.
class ActionTopics {
 public:
  // A mirror of this topic exists; `feeds`: it has settled.
  void set(const std::string& topic, MirrorId mirror, bool feeds);
  void remove(const std::string& topic, MirrorId mirror);
  // The actions (local names) of which that has changed since the last call.
  [[nodiscard]] std::set<std::string> take_changes() { return std::exchange(changed_, {}); }

  // Whether feedback and status of this action have mirrors here; the same, and these feed.
  [[nodiscard]] bool are_mirrored(const std::string& action) const { return all(action, false); }
  [[nodiscard]] bool are_fed(const std::string& action) const { return all(action, true); }

 private:
  [[nodiscard]] bool all(const std::string& action, bool feed) const;

  std::map<std::string, std::map<MirrorId, bool>> topics_;  // whether each feeds
  std::set<std::string> changed_;
};

}  // namespace connect_bridge
