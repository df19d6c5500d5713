#include "core/connection/clock_estimate.hpp"

#include <gtest/gtest.h>

#include "unit/flow/script.hpp"

namespace connect_bridge {
namespace {

using flow_test::at_ms;
using std::chrono::milliseconds;

// Asked at `asked`, all in milliseconds of the asking side's clock; the peer's runs `offset` ahead
// and thinks for `thought`.
void measure(ClockEstimate& clock, int asked, int way_there, int thought, int way_back,
             int offset) {
  const int arrived = asked + way_there;
  const int answered = arrived + thought;
  clock.add({at_ms(asked), at_ms(arrived + offset), at_ms(answered + offset), 0},
            at_ms(answered + way_back));
}

TEST(ClockEstimate, NothingIsKnownAtFirst) {
  const ClockEstimate clock;
  EXPECT_FALSE(clock.known());
  EXPECT_EQ(clock.offset(), Duration::zero());
}

TEST(ClockEstimate, EqualWaysGiveTheOffsetExactly) {
  ClockEstimate clock;
  measure(clock, 100, 20, 500, 20, 7000);
  EXPECT_TRUE(clock.known());
  EXPECT_EQ(clock.offset(), milliseconds(7000));
  EXPECT_EQ(clock.round_trip(), milliseconds(40));
  EXPECT_EQ(clock.error_bound(), milliseconds(20));
}

TEST(ClockEstimate, APeerBehindHasANegativeOffset) {
  ClockEstimate clock;
  measure(clock, 100, 20, 0, 20, -50'000);
  EXPECT_EQ(clock.offset(), milliseconds(-50'000));
}

TEST(ClockEstimate, UnequalWaysErrWithinTheBound) {
  ClockEstimate clock;
  measure(clock, 100, 90, 0, 10, 7000);
  EXPECT_EQ(clock.offset(), milliseconds(7040));
  EXPECT_EQ(clock.error_bound(), milliseconds(50));
}

TEST(ClockEstimate, TheShortestRoundTripIsBelieved) {
  ClockEstimate clock;
  measure(clock, 0, 300, 0, 10, 7000);
  measure(clock, 1000, 10, 0, 10, 7000);
  measure(clock, 2000, 10, 0, 300, 7000);
  EXPECT_EQ(clock.offset(), milliseconds(7000));
  EXPECT_EQ(clock.round_trip(), milliseconds(20));
}

TEST(ClockEstimate, OnlySixteenSamplesAreRemembered) {
  ClockEstimate clock;
  measure(clock, 0, 1, 0, 1, 0);
  for (int i = 1; i <= 15; ++i) measure(clock, i * 1000, 50, 0, 50, 40);
  EXPECT_EQ(clock.offset(), milliseconds(0));
  measure(clock, 16'000, 50, 0, 50, 40);
  EXPECT_EQ(clock.offset(), milliseconds(40));
}

// Messages must not seem old, or new, for sixteen more seconds.
TEST(ClockEstimate, AClockThatIsSetIsNoticedAtOnce) {
  ClockEstimate clock;
  for (int i = 0; i < 5; ++i) measure(clock, i * 1000, 1, 0, 1, 7000);
  measure(clock, 5000, 20, 0, 30, 7500);  // the peer's was set
  EXPECT_EQ(clock.offset(), milliseconds(7495));
  measure(clock, 6000 - 500'000, 2, 0, 2, 507'500);  // ours was set back
  EXPECT_EQ(clock.offset(), milliseconds(507'500));
}

TEST(ClockEstimate, ImpossibleStampsAreIgnored) {
  ClockEstimate clock;
  const Stamp far = Stamp{1} << 62;
  clock.add({0, at_ms(1), at_ms(1), 0}, at_ms(2));
  clock.add({at_ms(0), 0, at_ms(1), 0}, at_ms(2));
  clock.add({at_ms(0), at_ms(1), far, 0}, at_ms(2));
  clock.add({-1, at_ms(1), at_ms(1), 0}, at_ms(2));
  clock.add({at_ms(0), at_ms(2), at_ms(1), 0}, at_ms(2));   // answered before it was asked
  clock.add({at_ms(5), at_ms(1), at_ms(1), 0}, at_ms(2));   // our own clock went back
  clock.add({at_ms(0), at_ms(1), at_ms(90), 0}, at_ms(2));  // thought longer than it all took
  EXPECT_FALSE(clock.known());
}

}  // namespace
}  // namespace connect_bridge
