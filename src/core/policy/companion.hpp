// What belongs together: an image and its CameraInfo.
#pragma once

#include <cstdint>
#include <string_view>

#include "core/policy/treatment.hpp"

namespace connect_bridge {

// How a topic's messages leave: by themselves; as the large ones that others wait for; or with the
// large one of the same stamp, node and namespace.
enum class Company : std::uint8_t { kNone, kLarge, kFollows };

// A CameraInfo follows, and what the rule names (`with_large`), unless it is urgent or high: what
// steers or is looked at first waits for nothing. Large is what is bulk by its type or its rule.
[[nodiscard]] Company company_of(std::string_view topic, std::string_view type,
                                 const Treatment& treatment);

// A hash of the namespace that messages of a topic are matched by. The forms in which
// image_transport sends an image (/camera/image_raw/compressed) are in that of the image.
[[nodiscard]] std::uint64_t company_namespace(std::string_view topic, Company company);
// A hash of a node's name; 0: it is not known.
[[nodiscard]] std::uint64_t company_node(std::string_view node);

}  // namespace connect_bridge
