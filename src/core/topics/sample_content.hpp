// Content that the core reads of samples whose type it knows.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/bytes.hpp"
#include "core/base/time.hpp"
#include "core/flow/out_message.hpp"
#include "core/graph/graph_view.hpp"
#include "core/policy/names.hpp"

namespace connect_bridge {

// The stamp of a sample whose type begins with a std_msgs/msg/Header, in ns. 0: the sample has no
// stamp, or is not in the representation that ROS 2 middlewares write.
[[nodiscard]] Stamp header_stamp(ByteView sample);

// The state of its publisher that the sample gives: a newer sample of the same state replaces it.
// Most types have one state (0). A tf2_msgs/msg/TFMessage gives the state of its frames, a
// DiagnosticArray that of the parts that it names, a JointState that of its joints: nodes publish
// several in turn. nullopt: the names cannot be read, so the sample replaces nothing.
[[nodiscard]] std::optional<std::uint64_t> state_of(std::string_view type, ByteView sample);

// A packet of a video that somebody else has encoded; kNone: the sample is none. A publisher may
// have several cameras: the frame_id tells them apart.
struct PacketFacts {
  VideoPart part = VideoPart::kNone;
  std::uint64_t camera = 0;
};
[[nodiscard]] PacketFacts packet_of(std::string_view type, ByteView sample);

// The node whose parameters an rcl_interfaces/msg/ParameterEvent reports: the text after the stamp.
// The text points into the bytes of `sample`. nullopt: the event cannot be read, or is not in the
// representation that ROS 2 middlewares write. A reader may understand other representations, so
// such an event is attributed to no node.
[[nodiscard]] std::optional<std::string_view> node_of_parameter_event(ByteView sample);

// The same sample with the peer's nodes as they are called here, for types whose messages name
// them: parameter events; Log and DiagnosticArray on a topic that is not below the names' prefix
// (`topic`: its local name), where nothing else tells whose they are. nullopt: it stays as it is.
[[nodiscard]] std::optional<Payload> with_local_names(const std::string& topic,
                                                      std::string_view type, ByteView sample,
                                                      const NameMap& names);

// Is the event about its origin's node (`node`, the peer's name for it)? False for a node that
// publishes events here (`local`; may be null). Every node acts on an event with its name.
[[nodiscard]] bool is_event_of(const std::string& node, ByteView sample, const NameMap& names,
                               const TopicState* local);

}  // namespace connect_bridge
