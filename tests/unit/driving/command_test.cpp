#include "core/driving/command.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "unit/driving/samples.hpp"

namespace connect_bridge::driving {
namespace {

using driving_test::ackermann;
using driving_test::ackermann_stamped;
using driving_test::bytes_of;
using driving_test::twist;
using driving_test::twist_stamped;

constexpr Stamp kSomeTime = 1'700'000'000'123'456'789;

TEST(Command, FourTypesSteer) {
  EXPECT_EQ(command_type("geometry_msgs/msg/Twist"), CommandType::kTwist);
  EXPECT_EQ(command_type("geometry_msgs/msg/TwistStamped"), CommandType::kTwistStamped);
  EXPECT_EQ(command_type("ackermann_msgs/msg/AckermannDrive"), CommandType::kAckermann);
  EXPECT_EQ(command_type("ackermann_msgs/msg/AckermannDriveStamped"),
            CommandType::kAckermannStamped);
  EXPECT_EQ(command_type("sensor_msgs/msg/Joy"), std::nullopt);
  EXPECT_EQ(command_type("trajectory_msgs/msg/JointTrajectory"), std::nullopt);
}

TEST(Command, NeutralIsBelowAThousandth) {
  const auto moves = [](const Payload& sample) {
    return read_command(CommandType::kTwist, sample.view()).moves;
  };
  EXPECT_FALSE(moves(twist(0)));
  EXPECT_FALSE(moves(twist(-0.0009, 0.0009)));
  EXPECT_TRUE(moves(twist(0.001)));
  EXPECT_TRUE(moves(twist(0, -0.5)));
  EXPECT_TRUE(moves(twist(std::numeric_limits<double>::quiet_NaN())));
  // An angle does not move a car.
  const auto drives = [](const Payload& sample) {
    return read_command(CommandType::kAckermann, sample.view()).moves;
  };
  EXPECT_FALSE(drives(ackermann({0.4F, 1, 0, 2, 3})));
  EXPECT_TRUE(drives(ackermann({0, 0, -0.1F, 0, 0})));
}

TEST(Command, StampsAreFound) {
  const Payload sample = twist_stamped(kSomeTime, 1);
  const Command command = read_command(CommandType::kTwistStamped, sample.view());
  EXPECT_TRUE(command.readable);
  EXPECT_EQ(stamp_of(sample.view(), command.stamp), kSomeTime);
  const Payload drive = ackermann_stamped(kSomeTime, {0, 0, 1, 0, 0});
  const Command car = read_command(CommandType::kAckermannStamped, drive.view());
  EXPECT_TRUE(car.readable && car.moves);
  EXPECT_EQ(stamp_of(drive.view(), car.stamp), kSomeTime);
}

// The other endianness: the bytes of each number are reversed.
TEST(Command, BothEndiannessesAreRead) {
  Bytes sample = bytes_of(twist_stamped(kSomeTime, 0.5, "abc"));
  sample[1] = 0;
  const auto reverse = [&](std::ptrdiff_t at, std::ptrdiff_t size) {
    std::reverse(sample.begin() + at, sample.begin() + at + size);
  };
  for (const int at : {4, 8, 12}) reverse(at, 4);
  for (int i = 0; i < 6; ++i) reverse(20 + 8 * i, 8);
  const Command command = read_command(CommandType::kTwistStamped, sample);
  ASSERT_TRUE(command.readable);
  EXPECT_TRUE(command.moves);
  EXPECT_EQ(stamp_of(sample, command.stamp), kSomeTime);
  write_stamp(sample, command.stamp, kSomeTime + 1);
  EXPECT_EQ(stamp_of(sample, command.stamp), kSomeTime + 1);
  const Payload zero = halt_after(CommandType::kTwistStamped, sample, kSomeTime + 2);
  const Command halted = read_command(CommandType::kTwistStamped, zero.view());
  EXPECT_TRUE(halted.readable);
  EXPECT_FALSE(halted.moves);
  EXPECT_EQ(stamp_of(zero.view(), halted.stamp), kSomeTime + 2);
}

// Each length, with each frame: none of the others is taken for the type.
TEST(Command, BytesAreCheckedToTheLast) {
  for (const std::string frame : {"", "a", "base_link"}) {
    const Bytes whole = bytes_of(twist_stamped(kSomeTime, 0, frame));
    EXPECT_FALSE(read_command(CommandType::kTwistStamped, whole).moves);
    for (std::size_t size = 0; size < whole.size() + 8; ++size) {
      Bytes other = whole;
      other.resize(size);
      if (size == whole.size()) continue;
      const Command command = read_command(CommandType::kTwistStamped, other);
      EXPECT_FALSE(command.readable) << size;
      EXPECT_TRUE(command.moves) << size;
      EXPECT_EQ(command.stamp.at, 0U);
    }
    Bytes length = whole;
    length[12] = 0xff;
    length[15] = 0xff;
    EXPECT_FALSE(read_command(CommandType::kTwistStamped, length).readable);
    Bytes other = whole;
    other[1] = 3;  // with parameters
    EXPECT_FALSE(read_command(CommandType::kTwistStamped, other).readable);
  }
}

TEST(Command, AHaltKeepsFrameAndAngle) {
  EXPECT_EQ(bytes_of(halt_after(CommandType::kTwist, twist(1, 2).view(), 5)), bytes_of(twist(0)));
  EXPECT_EQ(bytes_of(halt_after(CommandType::kTwistStamped, twist_stamped(3, 1, "odom").view(),
                                kSomeTime)),
            bytes_of(twist_stamped(kSomeTime, 0, "odom")));
  EXPECT_EQ(bytes_of(halt_after(CommandType::kAckermannStamped,
                                ackermann_stamped(3, {0.3F, 0.1F, 2, 1, 1}).view(), kSomeTime)),
            bytes_of(ackermann_stamped(kSomeTime, {0.3F, 0.1F, 0, 0, 0})));
}

TEST(Command, ACommandThatCannotBeReadIsHaltedByAnEmptyOne) {
  const Bytes odd{0, 7, 0, 0, 1, 2, 3};
  EXPECT_EQ(bytes_of(halt_after(CommandType::kTwist, odd, 5)), bytes_of(twist(0)));
  EXPECT_EQ(bytes_of(halt_after(CommandType::kTwistStamped, odd, kSomeTime)),
            bytes_of(twist_stamped(kSomeTime, 0, "")));
  EXPECT_EQ(bytes_of(halt_after(CommandType::kAckermann, odd, 5)),
            bytes_of(ackermann({0, 0, 0, 0, 0})));
}

}  // namespace
}  // namespace connect_bridge::driving
