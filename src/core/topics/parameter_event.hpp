// What is read of an rcl_interfaces/msg/ParameterEvent.
#pragma once

#include <optional>
#include <string_view>

#include "core/base/cdr.hpp"

namespace connect_bridge {

// The node whose parameters have changed: the text behind the stamp. Lies in the bytes of `sample`.
// nullopt: it cannot be read, or is not in the representation that ROS 2 middlewares write; a
// reader may understand more than that, so such an event is nobody's.
inline std::optional<std::string_view> node_of_parameter_event(ByteView sample) {
  CdrReader reader(sample);
  if (!reader.u32() || !reader.u32()) return std::nullopt;
  return reader.string();
}

}  // namespace connect_bridge
