// A second implementation of the rules, written from their description alone: simple and slow, and
// without code of the policy that it checks.
#pragma once

#include <optional>
#include <string>

#include "core/policy/names.hpp"
#include "core/policy/policy.hpp"

namespace connect_bridge::sim {

// The one type of action in the simulation.
inline constexpr char kActionType[] = "test/action/Fib";
// As whom strangers log in.
inline constexpr char kStranger[] = "stranger";

bool is_permitted(const Policy& policy, Direction direction, const std::string& name,
                  const std::string& type, const Identity& who);

// The treatment of the first rule that allows, for a topic that is permitted.
std::optional<Treatment> treatment_of(const Policy& policy, Direction direction,
                                      const std::string& name, const std::string& type,
                                      const Identity& who);

// The same for a service: an ordinary one, a part of an action or one of a node's parameters.
std::optional<Treatment> service_treatment_of(const Policy& policy, Direction direction,
                                              const std::string& name, const std::string& type,
                                              const Identity& who);

// A side's names: a prefix and pairs of (name on the wire, name here).
struct Names {
  std::string prefix;
  std::vector<NameMap::Pair> remap;
  [[nodiscard]] std::string to_local(const std::string& wire) const;
  [[nodiscard]] std::optional<std::string> to_wire(const std::string& local) const;
};

}  // namespace connect_bridge::sim
