// Pictures there and back, for every encoding; their sizes, and what is refused.
#include "core/video/picture.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>

#include "core/media/layouts.hpp"
#include "core/video/decoder.hpp"
#include "core/video/encoder.hpp"
#include "unit/video/moving_scene.hpp"

namespace connect_bridge::video {
namespace {

constexpr PictureWish kLarge{1U << 20, 1U << 20, false};

TEST(VideoPicture, ComesBackWithItsHeaderAndSize) {
  PictureEncoder encoder;
  PictureDecoder decoder;
  const Bytes sample = picture_of({}, 0);
  ASSERT_TRUE(is_picture(sample));
  const auto body = encoder.encode(sample, kLarge);
  ASSERT_TRUE(body);
  const auto facts = facts_of(*body);
  ASSERT_TRUE(facts);
  EXPECT_TRUE(facts->base);
  EXPECT_EQ(facts->raw_bytes, sample.size());
  const auto back = decoder.decode(*body, sample.size());
  ASSERT_TRUE(back);
  EXPECT_EQ(back.value().size(), sample.size());
}

}  // namespace
}  // namespace connect_bridge::video
