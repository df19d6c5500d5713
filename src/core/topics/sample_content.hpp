// What is read of samples whose type is known to the core.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/bytes.hpp"
#include "core/base/time.hpp"
#include "core/graph/graph_view.hpp"
#include "core/policy/names.hpp"

namespace connect_bridge {

// The stamp of a sample whose type begins with a std_msgs/msg/Header, in ns; 0: it has none, or is
// not in the representation that ROS 2 middlewares write.
[[nodiscard]] Stamp header_stamp(ByteView sample);

// Which state of its publisher the sample tells: a newer sample of the same state replaces it. Most
// types have one (0). A tf2_msgs/msg/TFMessage tells that of its frames: nodes publish those of
// several in turn. nullopt: its frames cannot be read, so that it replaces nothing.
[[nodiscard]] std::optional<std::uint64_t> state_of(std::string_view type, ByteView sample);

// Of an rcl_interfaces/msg/ParameterEvent the node whose parameters have changed: the text after
// the stamp. Points into the bytes of `sample`. nullopt: it cannot be read, or is not in the
// representation that ROS 2 middlewares write. A reader may understand other representations too,
// so such an event is attributed to no node.
[[nodiscard]] std::optional<std::string_view> node_of_parameter_event(ByteView sample);

// Whether the event is about its origin's node (`node`, the peer's name for it) and not about a
// node that publishes events here (`local`; may be null). Needed because every node acts on an
// event with its name.
[[nodiscard]] bool is_event_of(const std::string& node, ByteView sample, const NameMap& names,
                               const TopicState* local);

}  // namespace connect_bridge
