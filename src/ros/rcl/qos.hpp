// Quality of service between the core's value and rmw's.
#pragma once

#include <rmw/qos_policy_kind.h>
#include <rmw/types.h>

#include <string>

#include "core/base/qos.hpp"

namespace connect_bridge::ros {

// From the graph's information about an endpoint. Unknown history or depth: depth 0.
[[nodiscard]] Qos from_rmw(const rmw_qos_profile_t& profile);
[[nodiscard]] rmw_qos_profile_t to_rmw(const Qos& qos);
// The QoS of our service servers and clients.
[[nodiscard]] rmw_qos_profile_t service_qos();
[[nodiscard]] std::string policy_name(rmw_qos_policy_kind_t kind);  // "reliability"

}  // namespace connect_bridge::ros
