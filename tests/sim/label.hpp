// The content of a simulated message: its publisher, its number and a checksum, so that a message
// that a mirror publishes can be matched with the one that was sent.
#pragma once

#include <cstdint>
#include <optional>

#include "core/base/bytes.hpp"

namespace connect_bridge::sim {

struct Label {
  std::uint32_t writer = 0;   // id of the publisher in the world
  std::uint64_t counter = 0;  // from 1
};

inline constexpr std::size_t kLabelBytes = 32;

// A serialized message of `size` bytes (at least kLabelBytes) that carries `label`.
Bytes make_message(const Label& label, std::size_t size, bool compressible);

// nullopt: not one of ours. The checksum is not looked at.
std::optional<Label> read_label(ByteView message);

// Whether the message is exactly as make_message() made it.
bool is_intact(ByteView message);

}  // namespace connect_bridge::sim
