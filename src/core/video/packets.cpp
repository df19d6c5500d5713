#include "core/video/packets.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>

#include "core/base/cdr.hpp"

namespace connect_bridge::video {
namespace {

// Of a packet's data; nullopt: they begin with no picture.
using IsKey = std::optional<bool> (*)(ByteView data);

// ---- H.264 and H.265: units behind start codes (annex B of both)

// The first byte behind the next start code, and what follows; nothing: there is none.
std::optional<ByteView> next_unit(ByteView data) {
  constexpr std::array<std::uint8_t, 3> kStartCode = {0, 0, 1};
  const auto at = std::search(data.begin(), data.end(), kStartCode.begin(), kStartCode.end());
  if (data.end() - at <= static_cast<std::ptrdiff_t>(kStartCode.size())) return std::nullopt;
  return data.subspan(static_cast<std::size_t>(at - data.begin()) + kStartCode.size());
}

// Parameters and other facts come before the first slice, which tells the kind of the picture.
constexpr int kUnitsMax = 32;
constexpr std::size_t kLookedAt = 64 << 10;  // bytes in which it begins

std::optional<bool> is_h264_key(ByteView data) {
  constexpr std::uint8_t kSliceFirst = 1, kIdrSlice = 5;
  data = data.first(std::min(data.size(), kLookedAt));
  for (int i = 0; i < kUnitsMax; ++i) {
    const auto unit = next_unit(data);
    if (!unit) break;
    const std::uint8_t type = unit->front() & 0x1f;
    if (type >= kSliceFirst && type <= kIdrSlice) return type == kIdrSlice;
    data = *unit;
  }
  return std::nullopt;
}

std::optional<bool> is_h265_key(ByteView data) {
  constexpr std::uint8_t kSliceLast = 31, kAccessFirst = 16, kAccessLast = 23;
  data = data.first(std::min(data.size(), kLookedAt));
  for (int i = 0; i < kUnitsMax; ++i) {
    const auto unit = next_unit(data);
    if (!unit) break;
    const std::uint8_t type = unit->front() >> 1 & 0x3f;
    if (type <= kSliceLast) return type >= kAccessFirst && type <= kAccessLast;
    data = *unit;
  }
  return std::nullopt;
}

// ---- VP8, VP9, AV1

std::optional<bool> is_vp8_key(ByteView data) {
  if (data.empty()) return std::nullopt;
  return (data[0] & 1) == 0;
}

// The uncompressed header: marker, profile, show_existing_frame, frame_type.
std::optional<bool> is_vp9_key(ByteView data) {
  if (data.empty() || data[0] >> 6 != 2) return std::nullopt;
  const bool has_reserved_bit = (data[0] >> 4 & 3) == 3;
  const int existing = has_reserved_bit ? 2 : 3;
  return (data[0] >> existing & 1) == 0 && (data[0] >> (existing - 1) & 1) == 0;
}

// A size as leb128, and what is behind it.
std::optional<ByteView> sized_payload(ByteView data) {
  std::uint64_t size = 0;
  for (std::size_t i = 0; i < 4 && i < data.size(); ++i) {
    size |= std::uint64_t{data[i] & 0x7fU} << (7 * i);
    if ((data[i] & 0x80) != 0) continue;
    const ByteView behind = data.subspan(i + 1);
    return size <= behind.size() ? std::optional(behind.first(size)) : std::nullopt;
  }
  return std::nullopt;
}

// The first frame header of the units: show_existing_frame, frame_type.
std::optional<bool> is_av1_key(ByteView data) {
  constexpr std::uint8_t kFrameHeader = 3, kFrame = 6;
  for (int i = 0; i < kUnitsMax && data.size() >= 2; ++i) {
    const std::uint8_t type = data[0] >> 3 & 15;
    const bool has_extension = (data[0] & 4) != 0, has_size = (data[0] & 2) != 0;
    const ByteView behind = data.subspan(has_extension ? 2 : 1);
    const auto payload = has_size ? sized_payload(behind) : std::optional(behind);
    if (!payload) break;
    if (type == kFrameHeader || type == kFrame) {
      if (payload->empty()) break;
      return payload->front() >> 5 == 0;
    }
    data = data.last(
        static_cast<std::size_t>(data.data() + data.size() - (payload->data() + payload->size())));
  }
  return std::nullopt;
}

struct KnownCodec {
  std::string_view name;
  IsKey is_key;
};
constexpr std::array kCodecs = {
    KnownCodec{"h264", is_h264_key}, KnownCodec{"h265", is_h265_key},
    KnownCodec{"hevc", is_h265_key}, KnownCodec{"vp8", is_vp8_key},
    KnownCodec{"vp9", is_vp9_key},   KnownCodec{"av1", is_av1_key},
};

bool is_same_word(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](unsigned char x, unsigned char y) {
    return std::tolower(x) == std::tolower(y);
  });
}

std::optional<VideoPacket> packet_of(std::string_view frame_id, std::string_view codec,
                                     ByteView data) {
  for (const KnownCodec& known : kCodecs) {
    if (!is_same_word(known.name, codec)) continue;
    const auto is_key = known.is_key(data);
    if (!is_key) return std::nullopt;
    return VideoPacket{frame_id, codec, *is_key};
  }
  return std::nullopt;
}

// ---- the messages

std::optional<VideoPacket> read_compressed_image(CdrReader& reader) {
  const auto sec = reader.u32(), nanosec = reader.u32();
  const auto frame_id = reader.string(), format = reader.string();
  const auto data = reader.octets();
  if (!sec || !nanosec || !frame_id || !format || !data) return std::nullopt;
  return packet_of(*frame_id, *format, *data);
}

std::optional<VideoPacket> read_compressed_video(CdrReader& reader) {
  const auto sec = reader.u32(), nanosec = reader.u32();
  const auto frame_id = reader.string();
  const auto data = reader.octets();
  const auto format = reader.string();
  if (!sec || !nanosec || !frame_id || !data || !format) return std::nullopt;
  return packet_of(*frame_id, *format, *data);
}

// FFmpeg says itself which packet is a key frame (AV_PKT_FLAG_KEY), of every codec.
std::optional<VideoPacket> read_ffmpeg_packet(CdrReader& reader) {
  constexpr std::uint8_t kKeyFlag = 1;
  const auto sec = reader.u32(), nanosec = reader.u32();
  const auto frame_id = reader.string();
  const auto width = reader.u32(), height = reader.u32();
  const auto encoding = reader.string();
  const auto pts = reader.u64();
  const auto flags = reader.u8(), big_endian = reader.u8();
  const auto data = reader.octets();
  if (!sec || !nanosec || !frame_id || !width || !height || !encoding || !pts || !flags ||
      !big_endian || !data)
    return std::nullopt;
  return VideoPacket{*frame_id, encoding->substr(0, encoding->find(';')), (*flags & kKeyFlag) != 0};
}

struct KnownMessage {
  std::string_view type;
  std::optional<VideoPacket> (*read)(CdrReader&);
};
constexpr std::array kMessages = {
    KnownMessage{"sensor_msgs/msg/CompressedImage", read_compressed_image},
    KnownMessage{"foxglove_msgs/msg/CompressedVideo", read_compressed_video},
    KnownMessage{"ffmpeg_image_transport_msgs/msg/FFMPEGPacket", read_ffmpeg_packet},
};

const KnownMessage* known_message(std::string_view type) {
  const auto known = std::find_if(kMessages.begin(), kMessages.end(),
                                  [&](const KnownMessage& one) { return one.type == type; });
  return known == kMessages.end() ? nullptr : &*known;
}

}  // namespace

std::optional<VideoPacket> read_packet(std::string_view type, ByteView raw) {
  const KnownMessage* const message = known_message(type);
  if (message == nullptr) return std::nullopt;
  CdrReader reader(raw);
  return message->read(reader);
}

}  // namespace connect_bridge::video
