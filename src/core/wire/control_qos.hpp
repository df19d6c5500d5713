// A quality of service in a control message.
#pragma once

#include "core/base/qos.hpp"
#include "core/wire/control_reader.hpp"

namespace connect_bridge {

// The member `qos` of `json`, which must be there.
Qos read_qos(ControlReader& reader, const Json& json);
OrderedJson json_of(const Qos& qos);

}  // namespace connect_bridge
