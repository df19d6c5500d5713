// The columns of a sensor_msgs/PointCloud2 by its fields. Order, count, padding and all fields stay
// as they are; with a step, x, y and z become multiples of it.
#pragma once

#include <cstdint>
#include <optional>

#include "core/media/columns.hpp"

namespace connect_bridge::media {

// `step_um`: micrometres; 0: exact. No x, y or z that is float32 moves by more than half a step;
// values that are not finite stay. nullopt: the sample is no PointCloud2 of little-endian points.
[[nodiscard]] std::optional<Columns> cloud_columns(ByteView raw, std::uint32_t step_um);

// The cloud with the first point of each cell of `grid_um` micrometres, in their order, as one row.
// Points that are not finite are left out. nullopt: the sample is no cloud with x, y and z.
[[nodiscard]] std::optional<Bytes> thinned(ByteView raw, std::uint32_t grid_um);

}  // namespace connect_bridge::media
