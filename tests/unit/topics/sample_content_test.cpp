// What is read of samples.
#include "core/topics/sample_content.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <initializer_list>
#include <utility>

#include "core/base/cdr.hpp"
#include "unit/media/samples.hpp"

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

Payload status_of(const char* name) {
  return CdrWriter()
      .u32(1)
      .u32(0)
      .string("")
      .u32(1)
      .u8(0)
      .string(name)
      .string("ok")
      .string("")
      .u32(1)
      .string("load")
      .string("3")
      .take();
}

TEST(SampleContent, DiagnosticsOfOtherPartsAndOtherJointsAreAnotherState) {
  const auto state_of_part = [](const char* name) {
    return state_of("diagnostic_msgs/msg/DiagnosticArray", status_of(name).view());
  };
  ASSERT_TRUE(state_of_part("arm"));
  EXPECT_EQ(state_of_part("arm"), state_of_part("arm"));
  EXPECT_NE(state_of_part("arm"), state_of_part("cam"));
  const auto state_of_joint = [](const char* name) {
    const Payload sample = CdrWriter().u32(1).u32(0).string("").u32(1).string(name).take();
    return state_of("sensor_msgs/msg/JointState", sample.view());
  };
  ASSERT_TRUE(state_of_joint("left"));
  EXPECT_NE(state_of_joint("left"), state_of_joint("right"));
}

TEST(SampleContent, PacketsOfAVideoAreOfTheCameraInTheirHeader) {
  const auto packet = [](const char* camera, std::uint8_t unit, const char* format = "h264") {
    return packet_of("sensor_msgs/msg/CompressedImage", media::SampleWriter()
                                                            .u32(1)
                                                            .u32(2)
                                                            .text(camera)
                                                            .text(format)
                                                            .octets(Bytes{0, 0, 1, unit, 9})
                                                            .bytes);
  };
  EXPECT_EQ(packet("left", 0x65).part, VideoPart::kKey);
  EXPECT_EQ(packet("left", 0x41).part, VideoPart::kRefers);
  EXPECT_EQ(packet("left", 0x65).camera, packet("left", 0x41).camera);
  EXPECT_NE(packet("left", 0x65).camera, packet("right", 0x65).camera);
  EXPECT_EQ(packet("left", 0x65, "jpeg").part, VideoPart::kNone);
}

TEST(SampleContent, APeersNodesHaveTheirNamesHere) {
  const NameMap names("/robot1", {});
  const auto event = [](const char* node) {
    return CdrWriter()
        .u32(7)
        .u32(8)
        .string(node)
        .u32(0)
        .u32(1)
        .string("gain")
        .u8(3)
        .u8(1)
        .u64(5)
        .u64(6)
        .string("text")
        .u32(1)
        .u8(9)
        .u32(0)
        .u32(1)
        .u64(2)
        .u32(0)
        .u32(1)
        .string("x")
        .u32(0)
        .take();
  };
  const auto renamed = with_local_names("/parameter_events", "rcl_interfaces/msg/ParameterEvent",
                                        event("/left/arm").view(), names);
  ASSERT_TRUE(renamed);
  const Payload wanted = event("/robot1/left/arm");
  EXPECT_TRUE(std::equal(wanted.view().begin(), wanted.view().end(), renamed->view().begin(),
                         renamed->view().end()));
  const auto log = [](const char* logger) {
    return CdrWriter()
        .u32(7)
        .u32(8)
        .u8(20)
        .string(logger)
        .string("m")
        .string("f")
        .string("g")
        .u32(3)
        .take();
  };
  const auto told =
      with_local_names("/rosout", "rcl_interfaces/msg/Log", log("left.arm").view(), names);
  ASSERT_TRUE(told);
  const Payload as_here = log("robot1.left.arm");
  EXPECT_TRUE(std::equal(as_here.view().begin(), as_here.view().end(), told->view().begin(),
                         told->view().end()));
  // Below the prefix the topic tells whose nodes they are.
  EXPECT_FALSE(
      with_local_names("/robot1/rosout", "rcl_interfaces/msg/Log", log("arm").view(), names));
  const auto part = with_local_names("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray",
                                     status_of("arm: load").view(), names);
  ASSERT_TRUE(part);
  const Payload status = status_of("robot1/arm: load");
  EXPECT_TRUE(std::equal(status.view().begin(), status.view().end(), part->view().begin(),
                         part->view().end()));
}

TEST(SampleContent, WhatIsCutOffOrOfAnotherTypeKeepsItsNames) {
  const NameMap names("/robot1", {});
  const Payload cut = CdrWriter().u32(7).u32(8).string("/arm").u32(0xffffffff).take();
  EXPECT_FALSE(with_local_names("/parameter_events", "rcl_interfaces/msg/ParameterEvent",
                                cut.view(), names));
  EXPECT_FALSE(with_local_names("/x", "p/msg/Any", cut.view(), names));
  EXPECT_FALSE(with_local_names("/parameter_events", "rcl_interfaces/msg/ParameterEvent",
                                cut.view(), NameMap()));
}

TEST(SampleContent, WhatCannotBeReadReplacesNothing) {
  EXPECT_FALSE(state(CdrWriter().u32(0xffffffff).u32(1).take()));
  EXPECT_FALSE(state(Payload::adopt({0, 0, 0, 0})));  // big-endian
  EXPECT_EQ(state_of("p/msg/Any", Payload::adopt({0}).view()), 0U);
}

}  // namespace
}  // namespace connect_bridge
