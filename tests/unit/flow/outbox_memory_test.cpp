// Waiting data has a share of the side's memory.
#include <gtest/gtest.h>

#include "core/flow/outbox.hpp"
#include "unit/flow/script.hpp"

namespace connect_bridge::flow_test {
namespace {

// As at its own limit: the oldest of the lowest class is dropped first.
TEST(OutboxMemory, WhatFindsNoMemoryTakesTheRoomOfLowerClasses) {
  Budget all(4000);
  Budget memory(&all);
  Outbox outbox({});
  outbox.draw_from(memory);
  outbox.add_channel(kA, queue(Priority::kBulk));
  outbox.add_channel(kB, queue(Priority::kUrgent));
  for (int i = 0; i < 30; ++i) outbox.push(kA, message(100), now_ms(0));
  EXPECT_LT(memory.used(), 2000U);
  EXPECT_GT(memory.used(), 1500U);
  const auto before = dropped(outbox, kA, DropReason::kMemory);
  EXPECT_GT(before, 0U);
  for (int i = 0; i < 5; ++i) outbox.push(kB, message(100), now_ms(0));
  EXPECT_EQ(dropped(outbox, kB, DropReason::kMemory), 0U);
  EXPECT_EQ(dropped(outbox, kA, DropReason::kMemory), before + 5);
  drain(outbox);
  EXPECT_EQ(memory.used(), 0U);
}

// A side with many connections asks most of them in vain, and TCP each time.
TEST(OutboxMemory, AsksToBePulledWhileAnythingWaitsOrIsOnItsWay) {
  Budget memory(4000);
  Outbox outbox({});
  outbox.draw_from(memory);
  outbox.add_channel(kA, queue(Priority::kNormal));
  EXPECT_FALSE(outbox.may_have_packet());
  outbox.push(kA, message(100), now_ms(0));
  EXPECT_TRUE(outbox.may_have_packet());
  const auto packet = outbox.next(now_ms(0));
  ASSERT_TRUE(packet);
  drain(outbox);  // gives its memory back
  EXPECT_TRUE(outbox.may_have_packet()) << "what TCP repairs matters until it has arrived";
  EXPECT_TRUE(outbox.acknowledge({packet->size(), 0}, now_ms(100)));
  EXPECT_FALSE(outbox.may_have_packet());
  ASSERT_TRUE(outbox.push_control({"{}"}));
  EXPECT_TRUE(outbox.may_have_packet());
  drain(outbox);
  EXPECT_FALSE(outbox.may_have_packet());
  outbox.push_small(AckFrame{100, 0});
  EXPECT_TRUE(outbox.may_have_packet());
  drain(outbox);
  EXPECT_FALSE(outbox.may_have_packet());
}

TEST(OutboxMemory, GivesBackWhatWasTakenOutBeforeItWaitsForMore) {
  Budget memory(4000);
  Outbox outbox({});
  outbox.draw_from(memory);
  outbox.add_channel(kA, queue(Priority::kNormal));
  outbox.push(kA, message(100), now_ms(0));
  outbox.remove_channel(kA);
  while (outbox.may_have_packet()) {
    ASSERT_FALSE(outbox.next(now_ms(0)));
  }
  EXPECT_EQ(memory.used(), 0U);
}

}  // namespace
}  // namespace connect_bridge::flow_test
