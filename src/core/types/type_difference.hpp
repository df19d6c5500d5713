// How two definitions of a type differ, for an engineer.
#pragma once

#include <string>

#include "core/types/type_description.hpp"

namespace connect_bridge {

// A hash in a line: "RIHS01_93da1a4b...".
[[nodiscard]] std::string shortened_hash(const std::string& hash);

// The differences fill no more than this many bytes of a line.
inline constexpr std::size_t kDifferenceBytesMax = 480;

// "the field 'covariance' (float64[36]) is only in the peer's definition; 'id' is int32 here and
// int64 there; geometry_msgs/msg/Pose: fields are in another order". The first few, then how many
// more there are; "none that a description shows" if the two are equal. All names in a description
// are identifiers, so the text is safe for a log.
[[nodiscard]] std::string difference(const TypeDescription& here, const TypeDescription& there);

}  // namespace connect_bridge
