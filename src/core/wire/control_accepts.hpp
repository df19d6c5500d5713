// The control message `accepts` as JSON.
#pragma once

#include "core/wire/control_reader.hpp"

namespace connect_bridge {

Accepts read_accepts(ControlReader& reader, const ControlReader::Json& json);
void put(const Accepts& message, nlohmann::ordered_json& json);

}  // namespace connect_bridge
