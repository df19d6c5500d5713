// The usual rate of a topic, and its silence.
#include "core/flow/pulse.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

using namespace std::chrono_literals;

constexpr TimePoint kStart{1000h};

TEST(Pulse, ASilenceLeavesTheRateBeforeIt) {
  Pulse pulse;
  pulse.begin(kStart);
  EXPECT_EQ(pulse.idle(kStart + 3s), 3s) << "nothing has come yet";
  for (int n = 1; n <= 30; ++n) pulse.beat(kStart + 60s + n * 100ms);
  EXPECT_EQ(pulse.idle(kStart + 70s), 7s);
  EXPECT_NEAR(*pulse.usual_rate(), 10, 0.01);
  pulse.begin(kStart + 80s);
  EXPECT_EQ(pulse.idle(kStart + 81s), 1s) << "somebody subscribes again";
  EXPECT_FALSE(pulse.usual_rate());
}

TEST(Pulse, AFewMessagesAndBurstsHaveNoRateOfSeveralASecond) {
  Pulse few, bursts;
  few.begin(kStart);
  bursts.begin(kStart);
  for (int n = 0; n < 19; ++n) few.beat(kStart + n * 10ms);
  EXPECT_FALSE(few.usual_rate());
  for (int burst = 0; burst < 5; ++burst)
    for (int n = 0; n < 10; ++n) bursts.beat(kStart + burst * 60s + n * 10ms);
  EXPECT_LT(*bursts.usual_rate(), 1);
}

}  // namespace
}  // namespace connect_bridge
