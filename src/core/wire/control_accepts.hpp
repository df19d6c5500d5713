// "accepts" from JSON.
#pragma once

#include "core/wire/control.hpp"
#include "core/wire/control_reader.hpp"

namespace connect_bridge {

// What a peer sends is hostile until it is checked; the reader keeps the first error.
Accepts read_accepts(ControlReader& reader, const ControlReader::Json& json);

}  // namespace connect_bridge
