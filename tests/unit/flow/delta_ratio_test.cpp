// Bytes on the wire for the usual small topics of a robot with `compression: auto` on a slow path,
// including headers, compared with no compression.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <string>

#include "core/flow/delta_encoder.hpp"
#include "core/wire/frame.hpp"

namespace connect_bridge {
namespace {

// Serializes as CDR does: aligned, little-endian.
class Cdr {
 public:
  template <class T>
  Cdr& add(T value) {
    while ((bytes_.size() - 4) % sizeof(T) != 0) bytes_.push_back(0);
    const auto at = bytes_.size();
    bytes_.resize(at + sizeof(T));
    std::memcpy(&bytes_[at], &value, sizeof(T));
    return *this;
  }
  Cdr& add(const std::string& text) {
    add(static_cast<std::uint32_t>(text.size() + 1));
    bytes_.insert(bytes_.end(), text.begin(), text.end());
    bytes_.push_back(0);
    return *this;
  }
  Cdr& header(int count, int rate, const std::string& frame) {
    add(1000 + count / rate);
    add(static_cast<std::uint32_t>(count % rate) * (1'000'000'000U / static_cast<unsigned>(rate)));
    return add(frame);
  }
  Payload done() { return Payload::adopt(std::move(bytes_)); }

 private:
  Bytes bytes_{0, 1, 0, 0};
};

// About a normal distribution.
double noise(double sigma) {
  static std::uint32_t state = 1;
  double sum = 0;
  for (int i = 0; i < 12; ++i) {
    state = state * 1664525 + 1013904223;
    sum += static_cast<double>(state >> 8) / (1 << 24) - 0.5;
  }
  return sum * sigma;
}

// 50 frames: joints turn about an axis, offsets stay.
Payload tf(int count) {
  Cdr cdr;
  cdr.add(50U);
  for (int joint = 0; joint < 50; ++joint) {
    cdr.header(count, 50, "robot/link_" + std::to_string(joint));
    cdr.add("robot/link_" + std::to_string(joint + 1));
    const double angle = std::sin(count * 0.02 + joint);
    for (const double value :
         {0.1234 * joint, 0.0, 0.77, 0.0, 0.0, std::sin(angle / 2), std::cos(angle / 2)})
      cdr.add(value);
  }
  return cdr.done();
}

// 30 joints whose encoders have 4096 steps.
Payload joint_states(int count) {
  Cdr cdr;
  cdr.header(count, 50, "").add(30U);
  for (int joint = 0; joint < 30; ++joint) cdr.add("left_arm_joint_" + std::to_string(joint));
  const double step = 6.283185307 / 4096;
  cdr.add(30U);
  for (int joint = 0; joint < 30; ++joint)
    cdr.add(std::round(std::sin(count * 0.006 + joint) / step) * step);
  cdr.add(30U);
  for (int joint = 0; joint < 30; ++joint)
    cdr.add(std::round(std::cos(count * 0.006 + joint) * 100) / 100);
  return cdr.add(0U).done();
}

// 1080 rays in a room, in millimetres with noise of 5, and intensities.
Payload scan(int count) {
  Cdr cdr;
  cdr.header(count, 10, "laser");
  for (int i = 0; i < 7; ++i) cdr.add(0.1F * static_cast<float>(i));
  cdr.add(1080U);
  for (int ray = 0; ray < 1080; ++ray) {
    const double angle = ray * 0.00436 + count * 0.001;
    const double wall = 3 / std::max(std::abs(std::cos(angle)), std::abs(std::sin(angle)));
    cdr.add(static_cast<float>(std::round((wall + noise(0.005)) * 1000) / 1000));
  }
  cdr.add(1080U);
  for (int ray = 0; ray < 1080; ++ray)
    cdr.add(static_cast<float>(std::round(800 + 200 * std::cos(ray * 0.01) + noise(5))));
  return cdr.done();
}

// To a compressor.
Payload jpeg(int) {
  Cdr cdr;
  for (int i = 0; i < 10'000; ++i)
    cdr.add(static_cast<std::uint8_t>(static_cast<int>(noise(1e6)) & 255));
  return cdr.done();
}

double share_on_the_wire(const std::function<Payload(int)>& make) {
  Budget bases;
  DeltaEncoder encoder({.automatic = true}, true, bases);
  std::size_t small = 0;
  std::size_t plain = 0;
  for (int count = 0; count < 500; ++count) {
    const DeltaEncoder::Message message{OriginId{1}, 1, make(count)};
    auto body = encoder.encode(message, 1e6);
    const Codec codec = body ? body->codec : Codec::kNone;
    encoder.sent(message, codec, body ? std::move(body->room) : Budget::Hold{});
    small += kMessageHeaderBytes + (body ? body->bytes : message.raw).size();
    plain += kMessageHeaderBytes + message.raw.size();
  }
  const double share = static_cast<double>(small) / static_cast<double>(plain);
  testing::Test::RecordProperty("percent", static_cast<int>(share * 100));
  return share;
}

TEST(DeltaRatio, Tf) {
  EXPECT_LT(share_on_the_wire(tf), 0.2);
}
TEST(DeltaRatio, JointStates) {
  EXPECT_LT(share_on_the_wire(joint_states), 0.3);
}
TEST(DeltaRatio, LaserScan) {
  EXPECT_LT(share_on_the_wire(scan), 0.6);
}
TEST(DeltaRatio, WhatIsCompressedAlreadyIsNoLarger) {
  EXPECT_LE(share_on_the_wire(jpeg), 1);
}

}  // namespace
}  // namespace connect_bridge
