// The messages of type_description_interfaces/srv/GetTypeDescription, by which nodes tell what
// their types are made of (REP-2016). Since ROS 2 Iron.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/base/bytes.hpp"
#include "core/types/type_description.hpp"

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

struct DescriptionRequest {
  std::string type;
  std::string hash;
  bool with_sources = true;
};

// nullopt: the bytes are no request.
[[nodiscard]] std::optional<DescriptionRequest> read_description_request(ByteView request);

// The response with a description, and one without. The sources of packages do not cross, so each
// type has the one that REP-2016 gives to types without a file ("dynamic", empty).
[[nodiscard]] Payload description_response(const TypeDescription& description, bool with_sources);
[[nodiscard]] Payload description_refusal(std::string_view why);

}  // namespace connect_bridge
