// The actions of the local graph. An action is offered as its parts, all of them or none.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "core/graph/claims.hpp"
#include "core/graph/graph_view.hpp"
#include "core/policy/interface.hpp"

namespace connect_bridge {

class LocalActions {
 public:
  // True if an action became whole or stopped being whole. Whole: its three services have real
  // servers, and its two topics have real publishers.
  bool update(const GraphView& graph, const Claims& claims);

  // For a part of an action: the action's type, or nullopt while the action is not whole. For
  // anything else: an empty text.
  [[nodiscard]] std::optional<std::string> type_of(InterfaceKind kind, const std::string& name,
                                                   const std::string& type) const;

 private:
  std::map<std::string, std::string> types_;  // of whole actions, by local name
};

}  // namespace connect_bridge
