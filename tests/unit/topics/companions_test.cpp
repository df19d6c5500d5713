// An image and its CameraInfo, from the graph to the link.
#include <gtest/gtest.h>

#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

Rule treated(const Treatment& treatment) {
  Rule rule = everything();
  rule.treatment = treatment;
  return rule;
}

// A camera: images and infos of one node, which a peer demands.
struct Camera {
  explicit Camera(const Treatment& treatment = {}, const std::string& node = "/cam")
      : s(server({treated(treatment)})) {
    auto images = topic("/c/image").pub(1, best_effort(), node);
    images.type = "sensor_msgs/msg/Image";
    auto infos = topic("/c/camera_info").pub(2, qos(), node);
    infos.type = "sensor_msgs/msg/CameraInfo";
    images.has_header = infos.has_header = true;
    s.graph({images, infos});
    s.join(1);
    s.demand(1, 1);
    s.demand(1, 2);
    s.did();
  }
  // What is said to the peer: i for an image, c for an info, each with its second.
  std::string said() {
    std::string result;
    std::string text = s.said(1);
    for (std::size_t at = 0; (at = text.find_first_of("ic", at)) != std::string::npos; ++at)
      result += text.substr(at, 1) + std::to_string(text[at - 8]) + ' ';
    return result;
  }
  void image(char second) { s.take(3, 1, stamped(second) + "i"); }
  void info(char second) { s.take(2, 2, stamped(second) + "c"); }
  static std::string stamped(char second) {
    std::string stamp(8, '\0');
    stamp[0] = second;
    return stamp;
  }
  Script s;
};

TEST(Companions, AnInfoLeavesWithItsImage) {
  Camera camera;
  for (char second = 1; second < 3; ++second) {
    camera.image(second);
    camera.s.pass(20);
  }
  EXPECT_EQ(camera.said(), "i1 i2 ");
  camera.info(3);
  EXPECT_EQ(camera.said(), "");
  camera.image(3);
  EXPECT_EQ(camera.said(), "i3 c3 ");
  camera.info(4);
  camera.s.pass(20);
  EXPECT_EQ(camera.said(), "c4 ");  // its image did not come within a period
}

TEST(Companions, ANodeMayHaveTheNameOfItsTopicsNamespace) {
  Camera camera({}, "/c");
  for (char second = 1; second < 3; ++second) {
    camera.image(second);
    camera.s.pass(20);
  }
  EXPECT_EQ(camera.said(), "i1 i2 ");
  camera.info(3);
  EXPECT_EQ(camera.said(), "");
  camera.image(3);
  EXPECT_EQ(camera.said(), "i3 c3 ");
}

TEST(Companions, AnInfoWithoutItsImageIsNotSent) {
  Treatment slow;
  slow.bytes_per_second_max = 100;  // the image uses up what there is
  Camera camera(slow);
  camera.image(1);
  camera.said();
  for (char second = 2; second < 9; ++second) {
    camera.s.pass(20);
    camera.image(second);
    camera.info(second);
    const auto said = camera.said();
    EXPECT_EQ(said.find('c') != std::string::npos, said.find('i') != std::string::npos) << said;
  }
}

TEST(Companions, ImagesThatNobodyWantsAnyMoreHoldNoInfo) {
  Camera camera;
  for (char second = 1; second < 3; ++second) {
    camera.image(second);
    camera.s.pass(20);
  }
  camera.said();
  camera.s.demand(1, 2, false);
  camera.s.pass(50);
  camera.info(3);
  EXPECT_EQ(camera.said(), "c3 ");
}

}  // namespace
}  // namespace connect_bridge::side_test
