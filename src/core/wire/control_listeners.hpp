// The control message `listeners` as JSON.
#pragma once

#include "core/wire/control_reader.hpp"

namespace connect_bridge {

Listeners read_listeners(ControlReader& reader, const Json& json);
void put(const Listeners& message, OrderedJson& json);

}  // namespace connect_bridge
