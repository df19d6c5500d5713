// Packets of videos: what is read lies within the sample, whatever its bytes are.
// Input: the type as one byte, then the sample.
#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/check.hpp"
#include "core/video/packets.hpp"

using namespace connect_bridge;

namespace {

bool lies_in(std::string_view part, ByteView all) {
  const auto* const begin = reinterpret_cast<const std::uint8_t*>(part.data());
  return begin >= all.data() && begin + part.size() <= all.data() + all.size();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::array<std::string_view, 3> kTypes = {
      "sensor_msgs/msg/CompressedImage", "foxglove_msgs/msg/CompressedVideo",
      "ffmpeg_image_transport_msgs/msg/FFMPEGPacket"};
  if (size == 0) return 0;
  const ByteView sample{data + 1, size - 1};
  const auto packet = video::read_packet(kTypes[data[0] % kTypes.size()], sample);
  if (!packet) return 0;
  CONNECT_CHECK(lies_in(packet->frame_id, sample) && lies_in(packet->codec, sample));
  return 0;
}
