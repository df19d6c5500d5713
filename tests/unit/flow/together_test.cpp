// What leaves with a large message: a CameraInfo with its image.
#include "core/flow/together.hpp"

#include <gtest/gtest.h>

#include <string>

#include "core/flow/outbox.hpp"
#include "unit/flow/script.hpp"

namespace connect_bridge::flow_test {
namespace {

constexpr std::uint64_t kCamera = 7;
constexpr ChannelId kImages = kA;
constexpr ChannelId kInfos = kB;

// A camera on a link of which each call of next() takes 100 bytes. Its period is 10 ms.
class Camera {
 public:
  Camera() {
    outbox.add_channel(kImages, queue(Priority::kBulk));
    outbox.add_channel(kInfos, queue(Priority::kNormal));
    image(1, 0);
    image(2, 10);
    drain(outbox);
  }
  static Moment moment(Stamp stamp, bool follows) { return {kCamera, stamp, follows}; }
  void image(Stamp stamp, std::int64_t ms, std::size_t bytes = 300) {
    expect(stamp, ms);
    push(kImages, stamp, ms, bytes, false);
  }
  void expect(Stamp stamp, std::int64_t ms) {
    outbox.expect(moment(stamp, false), now_ms(ms).steady);
  }
  void info(Stamp stamp, std::int64_t ms, bool event = false) {
    push(kInfos, stamp, ms, 50, true, event);
  }
  void push(ChannelId channel, Stamp stamp, std::int64_t ms, std::size_t bytes, bool follows,
            bool event = false) {
    OutMessage next = message(bytes, at_ms(ms));
    next.moment = moment(stamp, follows);
    if (!event) next.state = 0;
    outbox.push(channel, std::move(next), now_ms(ms));
  }
  // Lets a deadline come, and says what leaves.
  std::string at(std::int64_t ms) {
    outbox.on_time(now_ms(ms));
    return drain(outbox, now_ms(ms));
  }
  [[nodiscard]] std::uint64_t lost_infos() const {
    return outbox.counts(kInfos).dropped.of(DropReason::kNewerAvailable);
  }

  Outbox outbox{one_by_one()};
};

TEST(Together, TheSmallOneLeavesRightBehindTheLargeOne) {
  Camera camera;
  camera.image(3, 20);
  camera.info(3, 20);
  camera.image(4, 21);
  EXPECT_EQ(drain(camera.outbox), "1#3:100/300\n1+100\n1+100\n2#1:50\n1#4:100/300\n1+100\n1+100\n");
}

TEST(Together, ItWaitsForALargeOneThatComesLater) {
  Camera camera;
  camera.info(3, 20);
  EXPECT_EQ(drain(camera.outbox, now_ms(20)), "");
  EXPECT_EQ(camera.outbox.deadline(), now_ms(30).steady);
  camera.image(3, 25);
  EXPECT_EQ(drain(camera.outbox, now_ms(25)), "1#3:100/300\n1+100\n1+100\n2#1:50\n");
  EXPECT_EQ(camera.outbox.counts(kInfos).queued, 0U);
}

TEST(Together, WithoutOneItLeavesAPeriodLater) {
  Camera camera;
  camera.info(3, 20);
  EXPECT_EQ(camera.at(29), "");
  EXPECT_EQ(camera.at(30), "2#1:50\n");
  EXPECT_FALSE(camera.outbox.deadline());
}

TEST(Together, WhereNoneComeItWaitsForNothing) {
  Camera camera;
  camera.info(9, 31);  // the last image came two periods ago
  EXPECT_EQ(drain(camera.outbox, now_ms(31)), "2#1:50\n");
}

TEST(Together, OneWhoseLargeOneHasLeftLeavesAtOnce) {
  Camera camera;
  camera.info(2, 12);
  EXPECT_EQ(drain(camera.outbox, now_ms(12)), "2#1:50\n");
}

TEST(Together, AClockThatIsSetBackChangesNothing) {
  Camera camera;
  camera.image(1000, 20);
  drain(camera.outbox, now_ms(20));
  camera.image(3, 30);
  drain(camera.outbox, now_ms(30));
  camera.info(4, 35);
  EXPECT_EQ(drain(camera.outbox, now_ms(35)), "");
  camera.image(4, 40);
  EXPECT_EQ(drain(camera.outbox, now_ms(40)), "1#5:100/300\n1+100\n1+100\n2#1:50\n");
}

TEST(Together, ItIsDroppedWithTheLargeOne) {
  Camera camera;
  camera.expect(3, 20);  // for a worker, that compresses it
  camera.info(3, 20);
  EXPECT_EQ(drain(camera.outbox, now_ms(20)), "");
  camera.outbox.give_up(Camera::moment(3, false));
  EXPECT_EQ(drain(camera.outbox, now_ms(20)), "");
  EXPECT_EQ(camera.lost_infos(), 1U);
  camera.info(3, 21);
  EXPECT_EQ(camera.lost_infos(), 2U);
  expect_balance(camera.outbox.counts(kInfos));
}

TEST(Together, ALinkHasToDoOnceAnImageIsGivenUp) {
  Budget memory;
  Outbox outbox(one_by_one());
  outbox.draw_from(memory);
  outbox.add_channel(kInfos, queue(Priority::kNormal));
  outbox.expect(Camera::moment(3, false), now_ms(0).steady);
  OutMessage info = message(50, at_ms(0));
  info.moment = Camera::moment(3, true);
  outbox.push(kInfos, std::move(info), now_ms(0));
  EXPECT_EQ(drain(outbox), "");
  EXPECT_FALSE(outbox.may_have_packet());
  outbox.give_up(Camera::moment(3, false));
  EXPECT_TRUE(outbox.may_have_packet());
  EXPECT_EQ(drain(outbox), "2#1:50\n");
}

TEST(Together, AnEventIsNotDropped) {
  Camera camera;
  camera.expect(3, 20);
  camera.info(3, 20, true);
  camera.outbox.give_up(Camera::moment(3, false));
  EXPECT_EQ(drain(camera.outbox, now_ms(20)), "2#1:50\n");
}

TEST(Together, OneThatIsDroppedLetsNoEarlierOneGo) {
  Camera camera;
  camera.image(3, 20);
  camera.info(3, 20);
  camera.expect(4, 21);
  camera.info(4, 21);
  EXPECT_EQ(next(camera.outbox, now_ms(21)), "1#3:100/300");
  camera.outbox.give_up(Camera::moment(4, false));
  EXPECT_EQ(drain(camera.outbox, now_ms(22)), "1+100\n1+100\n2#1:50\n");
  EXPECT_EQ(camera.lost_infos(), 1U);
}

TEST(Together, OrderStays) {
  Camera camera;
  camera.image(3, 20);
  camera.info(4, 20);  // alone, a period later
  camera.info(3, 21);
  EXPECT_EQ(drain(camera.outbox, now_ms(21)), "1#3:100/300\n1+100\n1+100\n2#1:50\n2#2:50\n");
}

TEST(Together, OfTwoFormsOfAnImageTheFirstThatLeavesCounts) {
  Camera camera;
  camera.expect(3, 20);
  camera.image(3, 20);
  camera.info(3, 20);
  camera.outbox.give_up(Camera::moment(3, false));
  EXPECT_EQ(drain(camera.outbox, now_ms(20)), "1#3:100/300\n1+100\n1+100\n2#1:50\n");
}

TEST(Together, WhatWaitsForAnImageCountsAndEndsWithItsChannel) {
  Camera camera;
  camera.expect(3, 20);
  camera.info(3, 20);
  EXPECT_EQ(camera.outbox.counts(kInfos).queued, 1U);
  EXPECT_EQ(camera.outbox.data_bytes(), 50U);
  camera.outbox.clear_channel(kInfos);
  EXPECT_EQ(dropped(camera.outbox, kInfos, DropReason::kNoDemand), 1U);
  EXPECT_EQ(camera.outbox.data_bytes(), 0U);
  EXPECT_FALSE(camera.outbox.deadline());
}

TEST(Together, ImagesWhoseDemandEndsHoldNothing) {
  Camera camera;
  camera.image(3, 20);
  camera.info(3, 20, true);
  camera.outbox.clear_channel(kImages);
  EXPECT_EQ(drain(camera.outbox, now_ms(20)), "2#1:50\n");
}

TEST(Together, AfterABreakItIsKeptLikeTheRest) {
  Camera camera;
  camera.expect(3, 20);
  OutMessage info = message(50, at_ms(20));
  info.moment = Camera::moment(3, true);
  info.resumes = true;
  camera.outbox.push(kInfos, std::move(info), now_ms(20));
  EXPECT_EQ(camera.outbox.take_unarrived(kInfos).messages.size(), 1U);
  EXPECT_EQ(camera.outbox.data_bytes(), 0U);
  EXPECT_FALSE(camera.outbox.deadline());
}

TEST(Together, TooManyThatWaitGoAlone) {
  Camera camera;
  camera.expect(3, 20);
  for (int i = 0; i < 129; ++i) camera.info(3, 20, true);
  EXPECT_EQ(drain(camera.outbox, now_ms(20)), "2#1:50\n");
}

}  // namespace
}  // namespace connect_bridge::flow_test
