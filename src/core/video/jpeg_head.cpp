#include "core/video/jpeg_head.hpp"

namespace connect_bridge::video {
namespace {

// Markers of ITU-T T.81, table B.1, behind an 0xff.
constexpr std::uint8_t kMarker = 0xff;
constexpr std::uint8_t kStart = 0xd8;
constexpr std::uint8_t kBaseline = 0xc0;
constexpr std::uint8_t kProgressive = 0xc2;
constexpr std::uint8_t kHuffmanTables = 0xc4;
constexpr std::uint8_t kQuantiserTables = 0xdb;
constexpr std::uint8_t kRestartInterval = 0xdd;
constexpr std::uint8_t kApplicationFirst = 0xe0;
constexpr std::uint8_t kApplicationLast = 0xef;
constexpr std::uint8_t kComment = 0xfe;

constexpr int kSegmentsMax = 64;  // profiles of colours have some dozens

std::uint16_t be16(ByteView bytes, std::size_t at) {
  return static_cast<std::uint16_t>(bytes[at] << 8 | bytes[at + 1]);
}

bool may_come_before_the_frame(std::uint8_t marker) {
  return marker == kHuffmanTables || marker == kQuantiserTables || marker == kRestartInterval ||
         marker == kComment || (marker >= kApplicationFirst && marker <= kApplicationLast);
}

// The segment of a frame's head behind its length (section B.2.2).
std::optional<JpegHead> read_frame(ByteView segment) {
  constexpr std::size_t kFixedBytes = 6, kComponentBytes = 3;
  if (segment.size() < kFixedBytes || segment[0] != 8) return std::nullopt;
  const std::size_t components = segment[5];
  if (components != 1 && components != 3) return std::nullopt;
  if (segment.size() != kFixedBytes + kComponentBytes * components) return std::nullopt;
  return JpegHead{{be16(segment, 3), be16(segment, 1)}, components == 1};
}

}  // namespace

std::optional<JpegHead> jpeg_head(ByteView jpeg) {
  constexpr std::size_t kMarkerBytes = 2, kLengthBytes = 2;
  if (jpeg.size() < kMarkerBytes || jpeg[0] != kMarker || jpeg[1] != kStart) return std::nullopt;
  ByteView rest = jpeg.subspan(kMarkerBytes);
  for (int i = 0; i < kSegmentsMax && rest.size() >= kMarkerBytes + kLengthBytes; ++i) {
    const std::uint8_t marker = rest[1];
    const std::size_t bytes = be16(rest, kMarkerBytes);
    if (rest[0] != kMarker || bytes < kLengthBytes || bytes > rest.size() - kMarkerBytes)
      return std::nullopt;
    if (marker >= kBaseline && marker <= kProgressive)
      return read_frame(rest.subspan(kMarkerBytes + kLengthBytes, bytes - kLengthBytes));
    if (!may_come_before_the_frame(marker)) return std::nullopt;
    rest = rest.subspan(kMarkerBytes + bytes);
  }
  return std::nullopt;
}

}  // namespace connect_bridge::video
