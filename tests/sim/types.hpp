// What the types of the simulator are made of.
#pragma once

#include <string>

namespace connect_bridge::sim {

// All of them have one field.
[[nodiscard]] std::string text_of_type(const std::string& type);
[[nodiscard]] std::string hash_of_type(const std::string& type);

}  // namespace connect_bridge::sim
