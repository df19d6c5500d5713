// The control message `accepts` as JSON.
#pragma once

#include "core/wire/control_reader.hpp"

namespace connect_bridge {

Accepts read_accepts(ControlReader& reader, const Json& json);
void put(const Accepts& message, OrderedJson& json);

}  // namespace connect_bridge
