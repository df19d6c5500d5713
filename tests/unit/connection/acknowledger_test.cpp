// docs/protocol.md section 10, "Acknowledgements".
#include "core/connection/acknowledger.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "unit/flow/script.hpp"

namespace connect_bridge {
namespace {

constexpr Acknowledger::Contents kData{.data = true};
constexpr Acknowledger::Contents kAsks{.data = true, .asks = true};
constexpr Acknowledger::Contents kSmall{};  // ack and time frames only

TimePoint ms(std::int64_t t) {
  return flow_test::now_ms(t).steady;
}

// The count that is due; 0: none.
std::uint64_t due(Acknowledger& acknowledger, std::int64_t t) {
  const auto ack = acknowledger.take_due(ms(t));
  return ack ? ack->received_bytes : 0;
}

TEST(Acknowledger, NothingIsDueAtFirst) {
  Acknowledger acknowledger;
  EXPECT_FALSE(acknowledger.take_due(ms(1'000'000)));
  EXPECT_FALSE(acknowledger.deadline());
}

TEST(Acknowledger, DataIsAcknowledgedAHundredMillisecondsAfterTheFirst) {
  Acknowledger acknowledger;
  acknowledger.on_packet(10, kData, ms(1000));
  acknowledger.on_packet(20, kData, ms(1099));
  EXPECT_EQ(acknowledger.deadline(), ms(1100));
  EXPECT_EQ(due(acknowledger, 1099), 0U);
  EXPECT_EQ(due(acknowledger, 1100), 30U);
  EXPECT_FALSE(acknowledger.deadline());
  EXPECT_EQ(due(acknowledger, 9000), 0U);
}

TEST(Acknowledger, TheDelayBeginsAnewAfterAnAcknowledgement) {
  Acknowledger acknowledger;
  acknowledger.on_packet(10, kData, ms(0));
  EXPECT_EQ(due(acknowledger, 150), 10U);
  acknowledger.on_packet(10, kData, ms(160));
  EXPECT_EQ(acknowledger.deadline(), ms(260));
}

TEST(Acknowledger, WhatAsksIsAcknowledgedAtOnce) {
  Acknowledger acknowledger;
  acknowledger.on_packet(10, kAsks, ms(5));
  EXPECT_EQ(due(acknowledger, 5), 10U);
  acknowledger.on_packet(10, kData, ms(6));
  acknowledger.on_packet(8, kAsks, ms(7));
  EXPECT_EQ(due(acknowledger, 7), 28U);
  EXPECT_FALSE(acknowledger.deadline());
}

TEST(Acknowledger, TellsWhenTheLastBytesArrived) {
  Acknowledger acknowledger;
  acknowledger.on_packet(10, kData, ms(20));
  acknowledger.on_packet(10, kData, ms(40));
  const auto ack = acknowledger.take_due(ms(120));
  ASSERT_TRUE(ack);
  EXPECT_EQ(ack->arrived, ms(40).time_since_epoch().count());
}

TEST(Acknowledger, AMebibyteIsAcknowledgedAtOnce) {
  Acknowledger acknowledger;
  acknowledger.on_packet((1 << 20) - 1, kData, ms(0));
  EXPECT_EQ(due(acknowledger, 1), 0U);
  acknowledger.on_packet(1, kData, ms(1));
  EXPECT_EQ(due(acknowledger, 1), 1U << 20);
}

TEST(Acknowledger, SmallFramesStartNoTimerButCount) {
  Acknowledger acknowledger;
  acknowledger.on_packet(56, kSmall, ms(0));
  acknowledger.on_packet(0, kSmall, ms(0));
  EXPECT_FALSE(acknowledger.deadline());
  acknowledger.on_packet(100, kData, ms(5000));
  EXPECT_EQ(due(acknowledger, 5100), 156U);
  EXPECT_EQ(acknowledger.received_bytes(), 156U);
}

TEST(Acknowledger, SmallFramesDoNotPutOffWhatIsDue) {
  Acknowledger acknowledger;
  acknowledger.on_packet(100, kData, ms(0));
  acknowledger.on_packet(16, kSmall, ms(99));
  EXPECT_EQ(acknowledger.deadline(), ms(100));
}

TEST(Acknowledger, AcksOfSmallFramesAreAcknowledgedEveryMebibyte) {
  Acknowledger acknowledger;
  std::vector<std::uint64_t> counts;
  for (int i = 1; i <= 100'000; ++i) {
    acknowledger.on_packet(32, kSmall, ms(i));
    if (const auto count = due(acknowledger, i)) counts.push_back(count);
  }
  EXPECT_EQ(counts, (std::vector<std::uint64_t>{1 << 20, 2 << 20, 3 << 20}));
}

}  // namespace
}  // namespace connect_bridge
