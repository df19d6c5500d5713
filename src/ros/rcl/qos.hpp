// Conversion of quality of service between the core's value and rmw's.
#pragma once

#include <rmw/types.h>

#include "core/base/qos.hpp"

namespace connect_bridge::ros {

// Converts the graph's information about an endpoint. Unknown history or depth: depth 0.
[[nodiscard]] Qos from_rmw(const rmw_qos_profile_t& profile);
[[nodiscard]] rmw_qos_profile_t to_rmw(const Qos& qos);
// The QoS of our service servers and clients.
[[nodiscard]] rmw_qos_profile_t service_qos();

}  // namespace connect_bridge::ros
