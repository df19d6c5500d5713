#include "core/topics/subscription_turn.hpp"

#include <gtest/gtest.h>

#include <array>

namespace connect_bridge {
namespace {

using namespace std::chrono_literals;

TimePoint moment(Duration time) {
  return TimePoint{} + time;
}

TEST(SubscriptionTurn, ManyTopicsAreSubscribedOneAfterTheOther) {
  Pace all(2, 1ms);
  std::array<SubscriptionTurn, 5> topics;
  const Duration turns[] = {0ms, 0ms, 1ms, 2ms, 3ms};
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(topics[i].take(all, moment(0ms)), moment(turns[i]));
  // A topic that asks too early keeps its turn.
  EXPECT_EQ(topics[4].take(all, moment(1ms)), moment(3ms));
  EXPECT_EQ(topics[2].take(all, moment(1ms)), moment(1ms));
  EXPECT_EQ(topics[3].take(all, moment(10ms)), moment(10ms));
}

// Else one could ask for many, let their time pass, and use them all at once.
TEST(SubscriptionTurn, ThatIsNotTakenIsOver) {
  Pace all(1, 1ms);
  std::array<SubscriptionTurn, 4> topics;
  for (auto& topic : topics) static_cast<void>(topic.take(all, moment(0ms)));
  for (std::size_t i = 1; i < 4; ++i)
    EXPECT_EQ(topics[i].take(all, moment(1s)), moment(1s) + (i - 1) * Duration{1ms});
}

TEST(SubscriptionTurn, OneTopicIsNotSubscribedTooOften) {
  Pace all(100, 1ms);
  SubscriptionTurn topic;
  for (int i = 0; i < 10; ++i) EXPECT_EQ(topic.take(all, moment(0ms)), moment(0ms));
  EXPECT_EQ(topic.take(all, moment(0ms)), moment(1s));
  EXPECT_EQ(topic.take(all, moment(1s)), moment(1s));
}

}  // namespace
}  // namespace connect_bridge
