// docs/protocol.md section 10, "Acknowledgements".
#include "core/link/acknowledger.hpp"

#include <gtest/gtest.h>

#include "unit/flow/script.hpp"

namespace connect_bridge {
namespace {

constexpr bool kData = true;
constexpr bool kSmall = false;  // ack and time frames only

TimePoint ms(std::int64_t t) {
  return flow_test::now_ms(t).steady;
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
  EXPECT_FALSE(acknowledger.take_due(ms(1099)));
  EXPECT_EQ(acknowledger.take_due(ms(1100)), 30U);
  EXPECT_FALSE(acknowledger.deadline());
  EXPECT_FALSE(acknowledger.take_due(ms(9000)));
}

TEST(Acknowledger, TheDelayBeginsAnewAfterAnAcknowledgement) {
  Acknowledger acknowledger;
  acknowledger.on_packet(10, kData, ms(0));
  EXPECT_EQ(acknowledger.take_due(ms(150)), 10U);
  acknowledger.on_packet(10, kData, ms(160));
  EXPECT_EQ(acknowledger.deadline(), ms(260));
}

TEST(Acknowledger, SixtyFourKibAreAcknowledgedAtOnce) {
  Acknowledger acknowledger;
  acknowledger.on_packet(65'535, kData, ms(0));
  EXPECT_FALSE(acknowledger.take_due(ms(0)));
  acknowledger.on_packet(1, kData, ms(1));
  EXPECT_EQ(acknowledger.take_due(ms(1)), 65'536U);
  acknowledger.on_packet(1 << 20, kData, ms(1));
  EXPECT_EQ(acknowledger.take_due(ms(1)), 65'536U + (1 << 20));
}

TEST(Acknowledger, OnAFastLinkSixtyFourKibWaitForFiveMilliseconds) {
  Acknowledger acknowledger;
  acknowledger.on_packet(65'536, kData, ms(10));
  EXPECT_EQ(acknowledger.take_due(ms(10)), 65'536U);
  acknowledger.on_packet(65'536, kData, ms(11));
  EXPECT_EQ(acknowledger.deadline(), ms(15));
  acknowledger.on_packet(900'000, kData, ms(12));
  EXPECT_FALSE(acknowledger.take_due(ms(14)));
  EXPECT_EQ(acknowledger.take_due(ms(15)), 1'031'072U);
  acknowledger.on_packet(1 << 20, kData, ms(16));  // a mebibyte does not wait
  EXPECT_EQ(acknowledger.take_due(ms(16)), 1'031'072U + (1 << 20));
  acknowledger.on_packet(65'536, kData, ms(40));
  EXPECT_TRUE(acknowledger.take_due(ms(40)));
}

TEST(Acknowledger, SmallFramesStartNoTimerButCount) {
  Acknowledger acknowledger;
  acknowledger.on_packet(56, kSmall, ms(0));
  acknowledger.on_packet(0, kSmall, ms(0));
  EXPECT_FALSE(acknowledger.deadline());
  acknowledger.on_packet(100, kData, ms(5000));
  EXPECT_EQ(acknowledger.take_due(ms(5100)), 156U);
  EXPECT_EQ(acknowledger.received_bytes(), 156U);
}

TEST(Acknowledger, SmallFramesDoNotPutOffWhatIsDue) {
  Acknowledger acknowledger;
  acknowledger.on_packet(100, kData, ms(0));
  acknowledger.on_packet(16, kSmall, ms(99));
  EXPECT_EQ(acknowledger.deadline(), ms(100));
}

TEST(Acknowledger, AcksOfSmallFramesAreAcknowledgedEvery64KiB) {
  Acknowledger acknowledger;
  std::vector<std::uint64_t> counts;
  for (int i = 1; i <= 10'000; ++i) {
    acknowledger.on_packet(16, kSmall, ms(i));
    if (const auto count = acknowledger.take_due(ms(i))) counts.push_back(*count);
  }
  EXPECT_EQ(counts, (std::vector<std::uint64_t>{65'536, 131'072}));
  EXPECT_EQ(acknowledger.received_bytes(), 160'000U);
}

}  // namespace
}  // namespace connect_bridge
