// What is read of samples whose type is known to the core.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "core/base/bytes.hpp"
#include "core/base/time.hpp"

namespace connect_bridge {

// The stamp of a sample whose type begins with a std_msgs/msg/Header, in ns; 0: it has none, or is
// not in the representation that ROS 2 middlewares write.
[[nodiscard]] Stamp header_stamp(ByteView sample);

// Which state of its publisher the sample tells: a newer sample of the same state replaces it. Most
// types have one (0). A tf2_msgs/msg/TFMessage tells that of its frames: nodes publish those of
// several in turn. nullopt: its frames cannot be read, so that it replaces nothing.
[[nodiscard]] std::optional<std::uint64_t> state_of(std::string_view type, ByteView sample);

}  // namespace connect_bridge
