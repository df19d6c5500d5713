// The parameters that limit what peers may do.
#pragma once

#include "config/checked_values.hpp"
#include "core/side/options.hpp"

namespace connect_bridge {

// Sets those of the core's options that are limits.
void fill_limits(const CheckedValues& values, SideOptions& limits);

}  // namespace connect_bridge
