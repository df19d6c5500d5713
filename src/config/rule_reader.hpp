// Reads the rules among the parameters.
#pragma once

#include <string>
#include <vector>

#include "config/checked_values.hpp"
#include "config/parameter.hpp"
#include "core/policy/policy.hpp"

namespace connect_bridge {

struct RuleSet {
  std::vector<Rule> rules;
  bool defaults = false;  // no rules were given, and this is not the robot
  Duration clock_publish_period = Duration::zero();
  std::vector<std::string> clock_identities, clock_groups;  // peers whose time is published
};

// Reads the rules and adds to problems and warnings. The result is valid only if there are no
// problems. `around` knows which types are installed.
[[nodiscard]] RuleSet read_rules(const CheckedValues& values, bool is_robot, ReadAt moment,
                                 const Surroundings& around, std::vector<Problem>& problems,
                                 std::vector<std::string>& warnings);

// The default rule, for an operator's side without rules. Everything that the robot allows exists
// there. The robot may receive the topics of this side that the robot's rules import. It may never
// call services here: an operator does not trust a robot that far.
[[nodiscard]] Rule default_rule();

}  // namespace connect_bridge
