// What an installed type is made of.
#pragma once

#include <rosidl_runtime_c/message_type_support_struct.h>
#include <rosidl_runtime_c/service_type_support_struct.h>

#include <string>

namespace connect_bridge::ros {

// The canonical text (core/types/type_description.hpp) of the definition that the type support has
// in it. Empty: the distribution has none (before Iron).
[[nodiscard]] std::string description_of(const rosidl_message_type_support_t& type);
[[nodiscard]] std::string description_of(const rosidl_service_type_support_t& type);

}  // namespace connect_bridge::ros
