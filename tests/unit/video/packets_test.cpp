// Packets of videos: which of them are key frames.
#include "core/video/packets.hpp"

#include <gtest/gtest.h>

#include <string>

#include "unit/media/samples.hpp"

namespace connect_bridge::video {
namespace {

constexpr char kImage[] = "sensor_msgs/msg/CompressedImage";
constexpr char kVideo[] = "foxglove_msgs/msg/CompressedVideo";
constexpr char kPacket[] = "ffmpeg_image_transport_msgs/msg/FFMPEGPacket";

Bytes video_sample(ByteView data, std::string_view format) {
  return media::SampleWriter().u32(1).u32(2).text("left").octets(data).text(format).bytes;
}

Bytes ffmpeg_sample(std::uint8_t flags, ByteView data = Bytes{1, 2, 3}) {
  media::SampleWriter out;
  out.u32(1).u32(2).text("right").u32(640).u32(480).text("hevc;yuv420p;bgr8;bgr8");
  while ((out.bytes.size() - 4) % 8 != 0) out.u8(0);
  out.u32(7).u32(0).u8(flags).u8(0).octets(data);
  return out.bytes;
}

// Bytes of units of H.264 or H.265 behind start codes, of three and of four bytes.
Bytes units(std::initializer_list<std::uint8_t> heads) {
  Bytes out;
  for (const std::uint8_t head : heads) {
    if (out.size() % 2 == 0) out.push_back(0);
    out.insert(out.end(), {0, 0, 1, head, 0x42, 0x80});
  }
  return out;
}

std::optional<bool> is_key(std::string_view codec, ByteView data) {
  const Bytes sample = video_sample(data, codec);  // views of the packet point into it
  const auto packet = read_packet(kVideo, sample);
  if (!packet) return std::nullopt;
  EXPECT_EQ(packet->codec, codec);
  EXPECT_EQ(packet->frame_id, "left");
  return packet->is_key;
}

TEST(VideoPackets, OfH264AreKeysByTheirFirstSlice) {
  EXPECT_EQ(is_key("h264", units({0x67, 0x68, 0x06, 0x65, 0x41})), true);
  EXPECT_EQ(is_key("h264", units({0x09, 0x41, 0x65})), false);
  EXPECT_EQ(is_key("h264", units({0x25})), true);
  EXPECT_EQ(is_key("h264", units({0x01})), false);
  EXPECT_EQ(is_key("h264", units({0x67, 0x68})), std::nullopt);         // no picture
  EXPECT_EQ(is_key("h264", Bytes{0, 0, 0, 9, 0x65, 1}), std::nullopt);  // a length, no start code
  EXPECT_EQ(is_key("h264", Bytes{0, 0, 1}), std::nullopt);
  EXPECT_EQ(is_key("h264", Bytes{}), std::nullopt);
}

TEST(VideoPackets, OfH265AreKeysWhereADecoderMayBegin) {
  EXPECT_EQ(is_key("h265", units({0x40, 0x42, 0x44, 0x26})), true);  // IDR_W_RADL
  EXPECT_EQ(is_key("h265", units({0x2a})), true);                    // CRA
  EXPECT_EQ(is_key("h265", units({0x20})), true);                    // BLA
  EXPECT_EQ(is_key("hevc", units({0x46, 0x02})), false);             // TRAIL_R
  EXPECT_EQ(is_key("h265", units({0x1e})), false);
  EXPECT_EQ(is_key("h265", units({0x4e})), std::nullopt);
}

TEST(VideoPackets, OfVp8Vp9AndAv1AreKeysByTheirHeads) {
  EXPECT_EQ(is_key("vp8", Bytes{0x10, 2, 0}), true);
  EXPECT_EQ(is_key("vp8", Bytes{0x11, 2, 0}), false);
  EXPECT_EQ(is_key("vp9", Bytes{0x82, 0x49}), true);
  EXPECT_EQ(is_key("vp9", Bytes{0x86, 0}), false);
  EXPECT_EQ(is_key("vp9", Bytes{0x8a, 0}), false);  // shows another one
  EXPECT_EQ(is_key("vp9", Bytes{0xb0, 0}), true);   // profile 3 has one bit more
  EXPECT_EQ(is_key("vp9", Bytes{0xb2, 0}), false);
  EXPECT_EQ(is_key("vp9", Bytes{0x42, 0}), std::nullopt);  // no marker
  const Bytes delimiter{0x12, 0}, sequence{0x0a, 2, 7, 7};
  const auto joined = [&](ByteView frame) {
    Bytes out = delimiter;
    out.insert(out.end(), sequence.begin(), sequence.end());
    out.insert(out.end(), frame.begin(), frame.end());
    return out;
  };
  EXPECT_EQ(is_key("av1", joined(Bytes{0x32, 2, 0x10, 0})), true);
  EXPECT_EQ(is_key("av1", joined(Bytes{0x32, 2, 0x30, 0})), false);      // an inter frame
  EXPECT_EQ(is_key("av1", joined(Bytes{0x30, 0x10, 0})), true);          // its size is the rest
  EXPECT_EQ(is_key("av1", joined(Bytes{0x36, 9, 1, 0x10})), true);       // an extension
  EXPECT_EQ(is_key("av1", joined(Bytes{0x32, 9, 0x10})), std::nullopt);  // larger than the rest
  EXPECT_EQ(is_key("av1", joined(Bytes{0x32, 0})), std::nullopt);
  EXPECT_EQ(is_key("av1", delimiter), std::nullopt);
}

TEST(VideoPackets, AreThoseOfThreeTypes) {
  const Bytes of_ffmpeg = ffmpeg_sample(1);
  const auto ffmpeg = read_packet(kPacket, of_ffmpeg).value();
  EXPECT_TRUE(ffmpeg.is_key);
  EXPECT_EQ(ffmpeg.codec, "hevc");
  EXPECT_EQ(ffmpeg.frame_id, "right");
  EXPECT_FALSE(read_packet(kPacket, ffmpeg_sample(2)).value().is_key);
  const Bytes key = units({0x67, 0x65});
  const Bytes compressed = media::compressed_sample(key, "H264");
  const auto image = read_packet(kImage, compressed).value();
  EXPECT_TRUE(image.is_key);
  EXPECT_EQ(image.frame_id, "camera");
  EXPECT_FALSE(read_packet(kImage, media::compressed_sample(key, "jpeg")));
  EXPECT_FALSE(read_packet(kVideo, video_sample(key, "h266")));
  EXPECT_FALSE(read_packet("std_msgs/msg/String", video_sample(key, "h264")));
}

TEST(VideoPackets, AreWholeOrNone) {
  const Bytes key = units({0x67, 0x65});
  for (const auto& [type, sample] :
       {std::pair{kVideo, video_sample(key, "h264")}, std::pair{kPacket, ffmpeg_sample(1)},
        std::pair{kImage, media::compressed_sample(key, "h264")}}) {
    EXPECT_TRUE(read_packet(type, sample));
    for (std::size_t size = 0; size < sample.size(); ++size)
      EXPECT_FALSE(read_packet(type, ByteView(sample).first(size))) << type << size;
  }
}

}  // namespace
}  // namespace connect_bridge::video
