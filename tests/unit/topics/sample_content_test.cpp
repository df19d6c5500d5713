// What is read of samples.
#include "core/topics/sample_content.hpp"

#include <gtest/gtest.h>

#include <initializer_list>
#include <utility>

#include "core/base/cdr.hpp"

namespace connect_bridge {
namespace {

using Frames = std::initializer_list<std::pair<const char*, const char*>>;

Payload transforms(Frames frames, std::uint32_t stamp = 1) {
  CdrWriter writer;
  writer.u32(static_cast<std::uint32_t>(frames.size()));
  for (const auto& [parent, child] : frames) {
    writer.u32(stamp).u32(0).string(parent).string(child);
    for (std::uint64_t i = 0; i < 7; ++i) writer.u64(stamp + i);
  }
  return writer.take();
}

std::optional<std::uint64_t> state(const Payload& sample) {
  return state_of("tf2_msgs/msg/TFMessage", sample.view());
}

TEST(SampleContent, ReadsTheStampOfAHeader) {
  const Payload sample = CdrWriter().u32(1'700'000'000).u32(5).string("map").take();
  EXPECT_EQ(header_stamp(sample.view()), 1'700'000'000 * kStampSecond + 5);
  EXPECT_EQ(header_stamp(CdrWriter().u32(0xffffffff).u32(5).take().view()), 0);
  EXPECT_EQ(header_stamp(CdrWriter().u32(1).u32(1'000'000'000).take().view()), 0);
  EXPECT_EQ(header_stamp(CdrWriter().u32(1).take().view()), 0);
}

TEST(SampleContent, TransformsOfOtherFramesAreAnotherState) {
  const auto one = state(transforms({{"map", "odom"}}));
  ASSERT_TRUE(one);
  EXPECT_EQ(state(transforms({{"map", "odom"}}, 2)), one);
  EXPECT_NE(state(transforms({{"map", "base"}})), one);
  EXPECT_NE(state(transforms({{"map", "odom"}, {"odom", "base"}})), one);
  EXPECT_NE(state(transforms({{"mapo", "dom"}})), one);
  EXPECT_TRUE(state(transforms({})));
}

TEST(SampleContent, WhatCannotBeReadReplacesNothing) {
  EXPECT_FALSE(state(CdrWriter().u32(0xffffffff).u32(1).take()));
  EXPECT_FALSE(state(Payload::adopt({0, 0, 0, 0})));  // big-endian
  EXPECT_EQ(state_of("p/msg/Any", Payload::adopt({0}).view()), 0U);
}

}  // namespace
}  // namespace connect_bridge
