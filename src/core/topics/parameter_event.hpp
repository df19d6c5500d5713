// Reads the node's name from an rcl_interfaces/msg/ParameterEvent.
#pragma once

#include <string>

#include "core/base/bytes.hpp"
#include "core/graph/graph_view.hpp"
#include "core/policy/names.hpp"

namespace connect_bridge {

// The node whose parameters have changed: the text after the stamp. Points into the bytes of
// `sample`. nullopt: it cannot be read, or is not in the representation that ROS 2 middlewares
// write. A reader may understand other representations too, so such an event is attributed to no
// node.
[[nodiscard]] std::optional<std::string_view> node_of_parameter_event(ByteView sample);

// Whether the event is about its origin's node (`node`, the peer's name for it) and not about a
// node that publishes events here (`local`; may be null). Needed because every node acts on an
// event with its name.
[[nodiscard]] bool is_event_of(const std::string& node, ByteView sample, const NameMap& names,
                               const TopicState* local);

}  // namespace connect_bridge
