// Packets of a video that refer to a lost one, wherever it was lost.
#include "core/flow/packet_groups.hpp"

#include <gtest/gtest.h>

#include "core/flow/outbox.hpp"
#include "unit/flow/script.hpp"

namespace connect_bridge::flow_test {
namespace {

OutMessage packet(std::uint64_t number, VideoPart part, std::size_t size = 50) {
  OutMessage made = message(size);
  made.order = number;
  made.video = part;
  return made;
}
OutMessage key(std::uint64_t number, std::size_t size = 50) {
  return packet(number, VideoPart::kKey, size);
}
OutMessage delta(std::uint64_t number, std::size_t size = 50) {
  return packet(number, VideoPart::kRefers, size);
}

OutMessage of_camera(std::uint64_t camera, OutMessage packet) {
  packet.camera = camera;
  return packet;
}
// It comes and is the next to leave: does it?
bool leaves(PacketGroups& groups, OutMessage packet) {
  groups.came(packet);
  if (groups.misses(packet)) return false;
  groups.left(packet);
  return true;
}

TEST(PacketGroups, AGapIsDroppedUpToTheNextKey) {
  PacketGroups groups;
  EXPECT_FALSE(leaves(groups, delta(7)));  // a decoder cannot begin with it
  EXPECT_TRUE(leaves(groups, key(8)));
  EXPECT_TRUE(leaves(groups, delta(9)));
  EXPECT_FALSE(leaves(groups, delta(11)));
  EXPECT_FALSE(leaves(groups, delta(12)));
  EXPECT_TRUE(leaves(groups, key(13)));
  EXPECT_TRUE(leaves(groups, delta(14)));
}

TEST(PacketGroups, OtherMessagesAndUnknownNumbersPass) {
  PacketGroups groups;
  EXPECT_TRUE(leaves(groups, key(8)));
  OutMessage other = message(50);
  other.order = 20;
  EXPECT_TRUE(leaves(groups, other));
  EXPECT_TRUE(leaves(groups, delta(0)));
  OutMessage of_another = delta(20);
  of_another.subject = OriginId{77};
  EXPECT_FALSE(leaves(groups, of_another));
  of_another.subject = OriginId{78};
  of_another.order = 1;  // the first one ever
  EXPECT_TRUE(leaves(groups, of_another));
}

// A rate cuts the group of one camera: the packets of another go on, and a loss is still one.
TEST(PacketGroups, APacketThatARateLeavesOutIsNoGap) {
  PacketGroups groups;
  const OriginId publisher = key(1).subject.origin();
  EXPECT_TRUE(leaves(groups, of_camera(1, key(1))));
  EXPECT_TRUE(leaves(groups, of_camera(2, key(2))));
  groups.left_out(publisher, 3);  // of camera 1
  groups.left_out(publisher, 4);
  EXPECT_TRUE(leaves(groups, of_camera(2, delta(5))));
  groups.left_out(publisher, 7);
  EXPECT_FALSE(leaves(groups, of_camera(2, delta(8)))) << "6 was lost";
  EXPECT_TRUE(leaves(groups, of_camera(1, key(9))));
}

TEST(PacketGroups, ParametersBetweenPacketsAreNoGap) {
  PacketGroups groups;
  EXPECT_TRUE(leaves(groups, key(1)));
  OutMessage parameters = message(50);
  parameters.order = 2;
  EXPECT_TRUE(leaves(groups, parameters));
  EXPECT_TRUE(leaves(groups, delta(3)));
  parameters.order = 6;  // 4 and 5 were lost
  EXPECT_TRUE(leaves(groups, parameters));
  EXPECT_FALSE(leaves(groups, delta(7)));
  EXPECT_TRUE(leaves(groups, key(8)));
  parameters.order = 9;
  groups.came(parameters);
  groups.dropped(parameters);
  EXPECT_FALSE(leaves(groups, delta(10)));
}

TEST(PacketGroups, WithoutKeysGoOnAfterSomeTime) {
  PacketGroups groups;
  EXPECT_TRUE(leaves(groups, delta(1)));
  std::uint64_t number = 3;
  for (; number < 3 + PacketGroups::kSkippedMax; ++number)
    ASSERT_FALSE(leaves(groups, delta(number)));
  EXPECT_TRUE(leaves(groups, delta(number)));
  EXPECT_TRUE(leaves(groups, delta(number + 1)));
}

TEST(PacketGroups, OneThatWasAbortedIsMissed) {
  PacketGroups groups;
  EXPECT_TRUE(leaves(groups, key(1)));
  EXPECT_TRUE(leaves(groups, delta(2)));
  groups.dropped(delta(2));
  EXPECT_FALSE(leaves(groups, delta(3)));
}

// A lost one may have been of either, and the key of one is none for the other.
TEST(PacketGroups, TheCamerasOfAPublisherHaveKeysOfTheirOwn) {
  PacketGroups groups;
  const auto crosses = [&](std::uint64_t camera, const OutMessage& packet) {
    return leaves(groups, of_camera(camera, packet));
  };
  EXPECT_TRUE(crosses(1, key(1)));
  EXPECT_TRUE(crosses(2, key(2)));
  EXPECT_TRUE(crosses(1, delta(3)));
  EXPECT_TRUE(crosses(2, delta(4)));
  EXPECT_FALSE(crosses(2, delta(6)));
  EXPECT_TRUE(crosses(1, key(7)));
  EXPECT_FALSE(crosses(2, delta(8)));
  EXPECT_TRUE(crosses(1, delta(9)));
  EXPECT_FALSE(crosses(3, delta(10)));  // it may have begun with the lost one
  EXPECT_TRUE(crosses(2, key(11)));
  EXPECT_TRUE(crosses(2, delta(12)));
  EXPECT_TRUE(crosses(1, delta(13)));
}

TEST(PacketGroups, CamerasWithoutEndBeginAgain) {
  PacketGroups groups;
  std::uint64_t number = 0;
  for (std::uint64_t camera = 0; camera < PacketGroups::kCamerasMax; ++camera)
    EXPECT_TRUE(leaves(groups, of_camera(camera, key(++number))));
  EXPECT_TRUE(leaves(groups, of_camera(0, delta(++number))));
  EXPECT_TRUE(leaves(groups, of_camera(PacketGroups::kCamerasMax, key(++number))));
  EXPECT_FALSE(leaves(groups, of_camera(0, delta(++number))));
}

TEST(OutboxQueue, WhatRefersToADroppedPacketIsDropped) {
  Outbox outbox(one_by_one());
  auto options = queue(Priority::kNormal);
  options.depth = 1;  // it does not bound packets
  outbox.add_channel(kA, options);
  outbox.push(kA, key(1, 11), now_ms(0));
  EXPECT_EQ(drain(outbox), "1#1:11\n");
  for (std::uint64_t number = 3; number < 7; ++number)  // number 2 was lost before
    outbox.push(kA, delta(number, 10 + number), now_ms(0));
  EXPECT_EQ(drain(outbox), "");
  EXPECT_EQ(dropped(outbox, kA, DropReason::kGroup), 4U);
  outbox.push(kA, key(7, 17), now_ms(0));
  outbox.push(kA, delta(8, 18), now_ms(0));
  EXPECT_EQ(drain(outbox), "1#2:17\n1#3:18\n");
  outbox.push(kA, delta(10, 20), now_ms(0));  // 9 was lost before this queue
  EXPECT_EQ(drain(outbox), "");
  expect_balance(outbox.counts(kA));
}

TEST(OutboxQueue, ANewGroupTakesThePlaceOfAnOlderOneThatWaits) {
  Outbox outbox(one_by_one());
  outbox.add_channel(kA, queue(Priority::kNormal));
  outbox.push(kA, key(1, 11), now_ms(0));
  outbox.push(kA, delta(2, 12), now_ms(0));
  OutMessage other = message(19);
  other.subject = OriginId{77};
  outbox.push(kA, other, now_ms(0));
  outbox.push(kA, key(3, 13), now_ms(1));
  outbox.push(kA, delta(4, 14), now_ms(1));
  outbox.push(kA, key(5, 15), now_ms(1));  // all of one moment leave
  EXPECT_EQ(drain(outbox), "1#1:19\n1#2:13\n1#3:14\n1#4:15\n");
  EXPECT_EQ(dropped(outbox, kA, DropReason::kNewerAvailable), 2U);
  expect_balance(outbox.counts(kA));
}

// Of the other camera neither is dropped, and it misses none.
TEST(OutboxQueue, ANewGroupLeavesThoseOfAnotherCamera) {
  Outbox outbox(one_by_one());
  outbox.add_channel(kA, queue(Priority::kNormal));
  outbox.push(kA, of_camera(1, key(1, 11)), now_ms(0));
  outbox.push(kA, of_camera(2, key(2, 12)), now_ms(0));
  outbox.push(kA, of_camera(1, delta(3, 13)), now_ms(0));
  outbox.push(kA, of_camera(2, delta(4, 14)), now_ms(0));
  outbox.push(kA, of_camera(1, key(5, 15)), now_ms(1));
  outbox.push(kA, of_camera(2, delta(6, 16)), now_ms(1));
  EXPECT_EQ(drain(outbox), "1#1:12\n1#2:14\n1#3:15\n1#4:16\n");
  EXPECT_EQ(dropped(outbox, kA, DropReason::kNewerAvailable), 2U);
  expect_balance(outbox.counts(kA));
}

}  // namespace
}  // namespace connect_bridge::flow_test
