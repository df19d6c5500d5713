// The columns of a sensor_msgs/Image by its encoding: nothing of the sample is lost, not even the
// padding of its rows.
#pragma once

#include <optional>

#include "core/media/columns.hpp"

namespace connect_bridge::media {

// nullopt: the sample is no Image, or its size does not agree with its encoding.
[[nodiscard]] std::optional<Columns> image_columns(ByteView raw);

}  // namespace connect_bridge::media
