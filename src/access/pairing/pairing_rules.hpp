// Rules that a pairing writes for the operator's rights at the robot.
#pragma once

#include "core/base/parameter.hpp"

namespace connect_bridge {

// The operator may receive topics; with `operates`, also publish, call, send goals and set
// parameters. Nobody may receive /rosout, where any node of the robot writes whatever it likes, and
// nobody may publish there.
[[nodiscard]] ParameterMap robot_rules(bool operates);

// The rules among the parameters.
[[nodiscard]] ParameterMap rules_of(ParameterMap parameters);

// Whether the owner of a robot that is the client has changed the rules that its pairing wrote.
[[nodiscard]] bool has_own_rules(const ParameterMap& stored);

}  // namespace connect_bridge
