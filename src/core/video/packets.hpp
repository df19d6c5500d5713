// Packets of videos that somebody else has encoded, each a message: which of them a decoder can
// begin with. Cheap enough for the loop.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "core/base/bytes.hpp"

namespace connect_bridge::video {

// All views point into the sample.
struct VideoPacket {
  std::string_view frame_id;  // tells the cameras of one publisher apart
  std::string_view codec;     // as the message names it
  bool is_key = false;        // a decoder needs no packet before it
};

// nullopt: no packet, or of a codec whose key frames are not known here.
[[nodiscard]] std::optional<VideoPacket> read_packet(std::string_view type, ByteView raw);

}  // namespace connect_bridge::video
