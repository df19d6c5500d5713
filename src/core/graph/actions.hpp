// The actions of the local graph. An action is offered as its parts, all of them or none.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/graph/claims.hpp"
#include "core/graph/graph_view.hpp"
#include "core/policy/interface.hpp"

namespace connect_bridge {

// An action that would be whole if all types of its parts could be taken here.
struct LackedAction {
  std::string type;
  TypeLack lack;
};

class LocalActions {
 public:
  // Finds the whole actions of this graph: their three services have real servers, their two topics
  // have real publishers, and their types can be taken here. Returns the actions that became whole,
  // or stopped being whole.
  std::vector<std::string> update(const GraphView& graph, const Claims& claims);

  // For a part of an action: the action's type; nullopt while the action is not whole. For other
  // topics and services: an empty text.
  [[nodiscard]] std::optional<std::string> type_of(InterfaceKind kind, const std::string& name,
                                                   const std::string& type) const;

  // Actions that are not whole because of a type, by local name.
  [[nodiscard]] const std::map<std::string, LackedAction>& lacked() const { return lacked_; }

 private:
  std::map<std::string, std::string> types_;  // types of whole actions, by local name
  std::map<std::string, LackedAction> lacked_;
};

}  // namespace connect_bridge
