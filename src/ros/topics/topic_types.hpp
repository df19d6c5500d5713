// The reason why the middleware refuses an endpoint of a topic.
#pragma once

#include <rcl/types.h>

#include <string>

#include "ros/node/node.hpp"
#include "ros/rcl/rcl_result.hpp"

namespace connect_bridge::ros {

// `what` failed for an endpoint of this topic and type. A process of Fast DDS cannot have one topic
// with two types: if the graph shows another type, the refusal names it (code "type_mismatch").
// Otherwise the refusal has the middleware's text. Thread: the loop's.
[[nodiscard]] Refusal endpoint_failure(const Node& node, const std::string& topic,
                                       const std::string& type, const std::string& what,
                                       rcl_ret_t result);

}  // namespace connect_bridge::ros
