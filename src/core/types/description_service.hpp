// The messages of type_description_interfaces/srv/GetTypeDescription, by which nodes tell what
// their types are made of (REP-2016). Since ROS 2 Iron.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/base/bytes.hpp"

namespace connect_bridge {

inline constexpr std::string_view kDescriptionService = "get_type_description";  // behind a node's
inline constexpr std::string_view kDescriptionServiceType =
    "type_description_interfaces/srv/GetTypeDescription";

// A request for a type with this hash, without the sources of its package.
[[nodiscard]] Payload description_request(std::string_view type, std::string_view hash);

// The canonical text of the description in a node's response. nullopt: the node does not know it,
// the bytes are no response, or it is beyond a limit of core/types/type_description.hpp. Whether it
// is the type that was asked for, its hash shows.
[[nodiscard]] std::optional<std::string> text_of_response(ByteView response);

}  // namespace connect_bridge
