// JSON, in the two forms that the project uses.
#pragma once

#include <nlohmann/json.hpp>

namespace connect_bridge {

// JSON that is read, or whose members may have any order.
using Json = nlohmann::json;
// JSON for people and peers: members stay in the order in which they were added.
using OrderedJson = nlohmann::ordered_json;

}  // namespace connect_bridge
