// The actions of the local graph. An action is offered as its parts, all of them or none.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "core/graph/claims.hpp"
#include "core/graph/graph_view.hpp"
#include "core/policy/interface.hpp"

namespace connect_bridge {

// An action that would be whole, if all types of its parts could be taken here.
struct LackedAction {
  std::string type;
  TypeLack lack;
};

class LocalActions {
 public:
  // True if an action became whole or stopped being whole. Whole: its three services have real
  // servers, its two topics have real publishers, and their types can be taken here.
  bool update(const GraphView& graph, const Claims& claims);

  // For a part of an action: the action's type, or nullopt while the action is not whole. For
  // anything else: an empty text.
  [[nodiscard]] std::optional<std::string> type_of(InterfaceKind kind, const std::string& name,
                                                   const std::string& type) const;

  // By local name.
  [[nodiscard]] const std::map<std::string, LackedAction>& lacked() const { return lacked_; }

 private:
  std::map<std::string, std::string> types_;  // of whole actions, by local name
  std::map<std::string, LackedAction> lacked_;
};

}  // namespace connect_bridge
