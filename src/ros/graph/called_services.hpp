// Services that somebody waits for.
#pragma once

#include <functional>
#include <vector>

#include "core/ports/inputs.hpp"
#include "ros/node/node.hpp"

namespace connect_bridge::ros {

// The services that a node of others has a client of and that nobody serves: neither `served`,
// which are all that others serve, nor this process. At most some hundred. `between` is called
// before each long question. None if the middleware fails.
std::vector<CalledService> read_called(const Node& node, const std::vector<ServiceState>& served,
                                       const std::function<void()>& between);

}  // namespace connect_bridge::ros
