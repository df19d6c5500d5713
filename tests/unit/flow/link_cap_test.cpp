// A cap in bytes per second on what leaves on a link.
#include "core/flow/link_cap.hpp"

#include <gtest/gtest.h>

#include "core/flow/outbox.hpp"
#include "unit/flow/script.hpp"

namespace connect_bridge::flow_test {
namespace {

using namespace std::chrono_literals;

constexpr std::uint64_t kCap = 20'000;
constexpr std::int64_t kBurstBytes = 2'000;  // in LinkCap::kBurst

TimePoint at(Duration time) {
  return TimePoint{100s} + time;
}

OutboxOptions capped() {
  OutboxOptions options;
  options.bytes_per_second_max = kCap;
  options.queue_delay_target = {};  // nothing else holds back
  return options;
}

// What leaves, as it costs on the network, while somebody pulls every millisecond.
std::uint64_t pulled(Outbox& outbox, std::int64_t from_ms, std::int64_t to_ms) {
  std::uint64_t cost = 0;
  for (std::int64_t ms = from_ms; ms < to_ms; ++ms)
    while (const auto packet = outbox.next(now_ms(ms))) cost += LinkCap::cost(packet->size());
  return cost;
}

void fill(Outbox& outbox, ChannelId channel, int messages, std::size_t bytes, std::int64_t ms) {
  for (int i = 0; i < messages; ++i) outbox.push(channel, message(bytes), now_ms(ms));
}

TEST(LinkCap, ChargesWhatLiesBelowAMessage) {
  EXPECT_EQ(LinkCap::cost(100), 100U + 14 + 22 + 72);
  EXPECT_EQ(LinkCap::cost(2'000), 2'000U + 14 + 22 + 2 * 72);
  EXPECT_GT(LinkCap::cost(100'000), 100'000U + 6 * 22 + 70 * 72);
}

TEST(LinkCap, HoldsUntilWhatHasLeftIsPaidFor) {
  LinkCap cap(kCap);
  EXPECT_FALSE(cap.holds(at(0s)));
  cap.sent(20'000, at(0s));
  EXPECT_TRUE(cap.holds(at(900ms)));
  EXPECT_FALSE(cap.holds(at(1s)));
}

TEST(LinkCap, WhatIsNeverHeldBackOwesForABoundedTime) {
  LinkCap cap(kCap);
  for (int i = 0; i < 100; ++i) cap.sent(100'000, at(0s));
  EXPECT_EQ(cap.next_at(), at(LinkCap::kDebtMax));
}

TEST(LinkCap, AcknowledgementsOfWhatArrivesCount) {
  LinkCap cap(kCap);
  for (int i = 0; i < 10; ++i) cap.received(1'000'000, at(0s));
  EXPECT_TRUE(cap.holds(at(10s - 1ms)));
}

TEST(LinkCap, NoneHoldsNothing) {
  LinkCap cap(0);
  cap.sent(1 << 30, at(0s));
  cap.received(1 << 30, at(0s));
  EXPECT_FALSE(cap.holds(at(0s)));
  EXPECT_EQ(cap.part_bytes(1 << 20), 1U << 20);
}

TEST(OutboxCap, NoSecondCarriesMoreThanTheCapAndABurst) {
  Outbox outbox(capped());
  auto options = queue(Priority::kBulk);
  options.depth = 0;
  options.queue_bytes_max = 10 << 20;
  outbox.add_channel(kA, options);
  fill(outbox, kA, 50, 10'000, 1000);
  constexpr std::int64_t kPart = 1'600;
  for (std::int64_t second = 1; second < 20; ++second) {
    const auto carried =
        static_cast<std::int64_t>(pulled(outbox, 1000 * second, 1000 * second + 1000));
    EXPECT_LE(carried, std::int64_t{kCap} + kBurstBytes + kPart) << "second " << second;
    EXPECT_GE(carried, std::int64_t{kCap} - kPart) << "second " << second;
  }
}

TEST(OutboxCap, UrgentIsNotHeldBackButCounts) {
  Outbox outbox(capped());
  outbox.add_channel(kA, queue(Priority::kUrgent));
  outbox.add_channel(kB, queue(Priority::kNormal));
  fill(outbox, kA, 20, 1'000, 0);
  fill(outbox, kB, 1, 1'000, 0);
  EXPECT_GT(pulled(outbox, 0, 1), 20'000U) << "twenty urgent ones at once";
  EXPECT_EQ(outbox.counts(kB).sent, 0U);
  EXPECT_EQ(pulled(outbox, 1, 900), 0U) << "the other one waits until they are paid for";
  ASSERT_TRUE(outbox.deadline());
  static_cast<void>(pulled(outbox, 900, 1500));
  EXPECT_EQ(outbox.counts(kB).sent, 1U);
}

TEST(OutboxCap, LightMessagesAreHeldBackToo) {
  Outbox outbox(capped());
  auto options = queue(Priority::kNormal);
  options.may_be_light = true;
  options.depth = 0;
  outbox.add_channel(kA, options);
  fill(outbox, kA, 200, 500, 0);
  EXPECT_LE(pulled(outbox, 0, 1000), kCap + kBurstBytes + 1'600);
}

TEST(OutboxCap, IsTheRateThatOthersReckonWith) {
  Outbox outbox(capped());
  EXPECT_EQ(outbox.assumed_rate(), kCap);
  EXPECT_EQ(Outbox(OutboxOptions{}).assumed_rate(), 0);
}

// Of a connection that is open, as when the operator sets it while a link is up.
TEST(LinkCap, IsSetWhileItSends) {
  OutboxOptions free = capped();
  free.bytes_per_second_max = 0;
  Outbox outbox(free);
  outbox.add_channel({1}, {});
  fill(outbox, {1}, 200, 10'000, 0);
  outbox.set_cap(kCap, now_ms(0));
  EXPECT_LT(pulled(outbox, 1, 1001), kCap + kCap / 4);
  outbox.set_cap(0, now_ms(1001));
  EXPECT_GT(pulled(outbox, 1001, 1010), 3 * kCap);
}

// As at each change of the rules.
TEST(LinkCap, ThatIsSetAgainOwesWhatItOwed) {
  Outbox outbox(capped());
  outbox.add_channel({1}, {});
  fill(outbox, {1}, 200, 10'000, 0);
  std::uint64_t cost = 0;
  for (std::int64_t ms = 1; ms < 1001; ++ms) {
    outbox.set_cap(kCap, now_ms(ms));
    cost += pulled(outbox, ms, ms + 1);
  }
  EXPECT_LT(cost, kCap + kCap / 4);
}

}  // namespace
}  // namespace connect_bridge::flow_test
