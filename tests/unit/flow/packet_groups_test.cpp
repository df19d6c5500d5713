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

TEST(PacketGroups, AGapIsDroppedUpToTheNextKey) {
  PacketGroups groups;
  EXPECT_TRUE(groups.misses(delta(7)));  // a decoder cannot begin with it
  groups.left(key(8));
  EXPECT_FALSE(groups.misses(delta(9)));
  groups.left(delta(9));
  EXPECT_TRUE(groups.misses(delta(11)));
  EXPECT_TRUE(groups.misses(delta(12)));
  EXPECT_FALSE(groups.misses(key(13)));
  groups.left(key(13));
  EXPECT_FALSE(groups.misses(delta(14)));
}

TEST(PacketGroups, OtherMessagesAndUnknownNumbersPass) {
  PacketGroups groups;
  groups.left(key(8));
  OutMessage other = message(50);
  other.order = 20;
  EXPECT_FALSE(groups.misses(other));
  EXPECT_FALSE(groups.misses(delta(0)));
  OutMessage of_another = delta(20);
  of_another.subject = OriginId{77};
  EXPECT_TRUE(groups.misses(of_another));
  of_another.order = 1;  // the first one ever
  EXPECT_FALSE(groups.misses(of_another));
}

TEST(PacketGroups, ParametersBetweenPacketsAreNoGap) {
  PacketGroups groups;
  groups.left(key(1));
  OutMessage parameters = message(50);
  parameters.order = 2;
  groups.left(parameters);
  EXPECT_FALSE(groups.misses(delta(3)));
  parameters.order = 5;  // 3 and 4 were lost
  groups.left(parameters);
  EXPECT_TRUE(groups.misses(delta(6)));
}

TEST(PacketGroups, WithoutKeysGoOnAfterSomeTime) {
  PacketGroups groups;
  groups.left(delta(1));
  std::uint64_t number = 3;
  for (; number < 3 + PacketGroups::kSkippedMax; ++number)
    ASSERT_TRUE(groups.misses(delta(number)));
  EXPECT_FALSE(groups.misses(delta(number)));
  groups.left(delta(number));
  EXPECT_FALSE(groups.misses(delta(number + 1)));
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

}  // namespace
}  // namespace connect_bridge::flow_test
