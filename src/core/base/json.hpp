// JSON, in the two forms that the project uses.
#pragma once

#include <nlohmann/json.hpp>

namespace connect_bridge {

// What is read, and what others must not need in any order.
using Json = nlohmann::json;
// What is written for people and peers: its members stay in the order in which they were added.
using OrderedJson = nlohmann::ordered_json;

}  // namespace connect_bridge
