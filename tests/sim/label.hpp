// The content of a simulated message: its publisher, its number and a checksum, so that a message
// that a mirror publishes can be matched with the one that was sent.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/base/bytes.hpp"

namespace connect_bridge::sim {

struct Label {
  std::uint32_t writer = 0;   // id of the publisher in the world
  std::uint64_t counter = 0;  // from 1
};

inline constexpr std::size_t kLabelBytes = 32;

// A serialized message of `size` bytes (at least kLabelBytes) that carries `label`.
Bytes make_message(const Label& label, std::size_t size, bool compressible);

// The same as the data of a sensor_msgs/msg/Image (rgb8) of about that size, at least 32 x 32.
Bytes make_image(const Label& label, std::size_t size, bool compressible);
// An Image with this beginning.
Bytes image_of(const Label& label, ByteView prefix, std::size_t data_bytes, bool compressible);
// As one of the type is made.
inline Bytes make_message(const std::string& type, const Label& label, std::size_t size,
                          bool compressible) {
  return type == "sensor_msgs/msg/Image" ? make_image(label, size, compressible)
                                         : make_message(label, size, compressible);
}
// How such a message was made.
bool is_compressible(ByteView message);

// nullopt: not one of ours. The checksum is not looked at.
std::optional<Label> read_label(ByteView message);

// Whether the message is exactly as make_message() made it.
bool is_intact(ByteView message);

}  // namespace connect_bridge::sim
