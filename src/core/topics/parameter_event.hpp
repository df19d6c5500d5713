// What is read of an rcl_interfaces/msg/ParameterEvent.
#pragma once

#include <string>

#include "core/base/bytes.hpp"
#include "core/graph/graph_view.hpp"
#include "core/policy/policy.hpp"

namespace connect_bridge {

// The node whose parameters have changed: the text behind the stamp. Lies in the bytes of `sample`.
// nullopt: it cannot be read, or is not in the representation that ROS 2 middlewares write; a
// reader may understand more than that, so such an event is nobody's.
[[nodiscard]] std::optional<std::string_view> node_of_parameter_event(ByteView sample);

// Every node acts upon an event that tells its name, so an event is only of its origin's node
// (`node`, as the peer calls it), and never of one that publishes events here (`local`; may be
// null).
[[nodiscard]] bool is_event_of(const std::string& node, ByteView sample, const NameMap& names,
                               const TopicState* local);

}  // namespace connect_bridge
