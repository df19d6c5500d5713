// Bodies that a peer made up, damaged or left out.
#include <gtest/gtest.h>

#include <vector>

#include "core/base/byte_order.hpp"
#include "core/video/body.hpp"
#include "core/video/decoder.hpp"
#include "core/video/encoder.hpp"
#include "core/video/picture.hpp"
#include "unit/media/samples.hpp"
#include "unit/video/moving_scene.hpp"

namespace connect_bridge::video {
namespace {

class VideoHostile : public testing::Test {
 protected:
  void SetUp() override {
    if (!available()) GTEST_SKIP() << "the build has no libvpx";
    PictureEncoder encoder;
    for (std::uint32_t number = 0; number < 6; ++number) {
      const Bytes sample = picture_of(scene_, number);
      raw_bytes_ = sample.size();
      bodies_.push_back(encoder.encode(sample, {3000, 1U << 20}).value_or(Bytes{}));
    }
  }
  bool decodes(ByteView body) { return decoder_.decode(body, raw_bytes_).ok(); }
  // Nothing is taken of the body, and what follows needs a base.
  void expect_refused(ByteView body) {
    ASSERT_TRUE(decodes(bodies_[0]));
    const auto refused = decoder_.decode(body, raw_bytes_);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, CloseCode::kMalformed);
    EXPECT_FALSE(decodes(bodies_[1]));
    EXPECT_TRUE(decodes(bodies_[0]));
  }
  Bytes with(std::size_t at, std::uint8_t value) const {
    Bytes body = bodies_[0];
    body[at] = value;
    return body;
  }
  [[nodiscard]] std::size_t frame_at() const {
    return kBodyHeadBytes + get_le<std::uint32_t>(bodies_[0], 4);
  }

  Scene scene_{96, 64, "rgb8", 3, 2, 0, 1, 3};
  PictureDecoder decoder_;
  std::vector<Bytes> bodies_;
  std::size_t raw_bytes_ = 0;
};

TEST_F(VideoHostile, DeltaWithoutABaseIsMalformed) {
  EXPECT_FALSE(decodes(bodies_[1]));
  EXPECT_TRUE(decodes(bodies_[0]));
  EXPECT_TRUE(decodes(bodies_[1]));
  EXPECT_FALSE(PictureDecoder().decode(bodies_[1], raw_bytes_));
}

TEST_F(VideoHostile, DeltaAfterADroppedOneHasItsSizeOrIsRefused) {
  ASSERT_TRUE(decodes(bodies_[0]));
  for (const std::size_t number : {2U, 4U, 3U, 5U, 1U}) {
    const auto raw = decoder_.decode(bodies_[number], raw_bytes_);
    EXPECT_TRUE(!raw || raw.value().size() == raw_bytes_);
  }
}

TEST_F(VideoHostile, HeadIsChecked) {
  expect_refused(Bytes{});
  expect_refused(with(0, 2));   // version
  expect_refused(with(1, 0));   // no base, but a key frame
  expect_refused(with(1, 3));   // half size, but the frame has all
  expect_refused(with(1, 5));   // a flag that nobody knows
  expect_refused(with(2, 64));  // quantiser
  expect_refused(with(3, 1));   // zero
  expect_refused(with(4, 0));   // bytes of the prefix
  expect_refused(with(7, 255));
  Bytes delta = bodies_[1];
  delta[1] = 1;
  expect_refused(delta);
}

TEST_F(VideoHostile, FrameHasTheSizeOfTheSample) {
  const std::size_t at = frame_at();
  expect_refused(with(at + 6, 97));
  expect_refused(with(at + 8, 65));
  expect_refused(with(at + 7, 0x40));  // to be scaled
  expect_refused(with(at + 9, 0x80));
  expect_refused(with(at + 3, 0));                                              // no start code
  expect_refused(with(at, bodies_[0][at] | 2));                                 // another version
  expect_refused(with(at, static_cast<std::uint8_t>(bodies_[0][at] & ~0x10)));  // not shown
  expect_refused(with(at + 2, 255));  // its first part is larger than the frame
  Scene small = scene_;
  small.width = 64;
  PictureEncoder encoder;
  static_cast<void>(encoder.encode(picture_of(small, 0), {3000, 1U << 20}));
  const auto delta = encoder.encode(picture_of(small, 1), {3000, 1U << 20});
  const std::size_t raw_bytes = picture_of(small, 1).size();
  ASSERT_TRUE(delta && facts_of(*delta));
  ASSERT_TRUE(decodes(bodies_[0]));
  EXPECT_FALSE(decoder_.decode(*delta, raw_bytes));
}

TEST_F(VideoHostile, AnnouncedSizeIsTheSamples) {
  for (const std::size_t raw_bytes :
       {std::size_t{0}, raw_bytes_ - 1, raw_bytes_ + 1, std::size_t{1} << 40}) {
    EXPECT_FALSE(decoder_.decode(bodies_[0], raw_bytes));
  }
  EXPECT_TRUE(decodes(bodies_[0]));
}

TEST_F(VideoHostile, PrefixAloneMakesNoLargeSample) {
  // Height, width and step that agree with each other, but are out of bounds.
  media::SampleWriter prefix;
  prefix.u32(1).u32(2).text("camera").u32(60'000).u32(60'000).text("mono8").u8(0).u32(60'000);
  prefix.u32(3'600'000'000U);
  PictureBody body;
  body.base = true;
  body.prefix = prefix.bytes;
  const Bytes frame{0x10, 0, 0, 0x9d, 0x01, 0x2a, 0x60, 0xea, 0x60, 0xea, 0};
  body.frame = frame;
  EXPECT_FALSE(facts_of(write_body(body)));
  EXPECT_FALSE(decoder_.decode(write_body(body), prefix.bytes.size() + 3'600'000'000U));
}

TEST_F(VideoHostile, EachTruncationIsRefusedOrHasItsSize) {
  for (std::size_t size = 0; size < bodies_[0].size(); ++size) {
    const ByteView cut = ByteView(bodies_[0]).first(size);
    const auto facts = facts_of(cut);
    const auto raw = decoder_.decode(cut, raw_bytes_);
    EXPECT_TRUE(!raw || raw.value().size() == raw_bytes_);
    EXPECT_TRUE(facts || !raw);
    EXPECT_TRUE(size > frame_at() + 10 || !raw) << size;
  }
  EXPECT_TRUE(decodes(bodies_[0]));
}

TEST_F(VideoHostile, EachFlippedByteIsRefusedOrHasItsSize) {
  for (const std::size_t number : {0U, 1U}) {
    for (std::size_t at = 0; at < bodies_[number].size(); ++at) {
      Bytes body = bodies_[number];
      body[at] = static_cast<std::uint8_t>(body[at] ^ 0xff);
      if (number > 0) static_cast<void>(decodes(bodies_[0]));
      const auto raw = decoder_.decode(body, raw_bytes_);
      EXPECT_TRUE(!raw || raw.value().size() == raw_bytes_);
      static_cast<void>(decodes(bodies_[1]));
    }
  }
  EXPECT_TRUE(decodes(bodies_[0]));
  EXPECT_TRUE(decodes(bodies_[1]));
}

}  // namespace
}  // namespace connect_bridge::video
