// What a pairing lets the operator do at the robot, as the rules that it writes.
#pragma once

#include "core/base/parameter.hpp"

namespace connect_bridge {

// The operator may receive topics; if it operates, also publish, call, send goals and set
// parameters. Nobody gets /rosout: any node of the robot writes there whatever it likes; nor may
// anybody write lines there.
[[nodiscard]] ParameterMap robot_rules(bool operates);

// The rules among the parameters.
[[nodiscard]] ParameterMap rules_of(ParameterMap parameters);

// Whether the owner of a robot that dials has changed the rules that its pairing wrote.
[[nodiscard]] bool has_own_rules(const ParameterMap& stored);

}  // namespace connect_bridge
