#include "ros/graph/asked_topics.hpp"

#include <gtest/gtest.h>

namespace connect_bridge::ros {
namespace {

using namespace std::chrono_literals;

AskedTopics::TimePoint moment(std::chrono::milliseconds time) {
  return AskedTopics::TimePoint{} + time;
}

TEST(AskedTopics, AreReadAtOnceAndSomeTimesAgain) {
  AskedTopics asked;
  EXPECT_FALSE(asked.deadline());
  EXPECT_FALSE(asked.take_due(moment(0ms)));
  asked.ask("/a", moment(0ms));
  for (const auto time : {0ms, 10ms, 30ms, 70ms, 150ms}) {
    EXPECT_EQ(moment(time), asked.deadline());
    if (time > 0ms) {
      EXPECT_FALSE(asked.take_due(moment(time - 1ms)));
    }
    EXPECT_EQ("/a", asked.take_due(moment(time)));
    EXPECT_FALSE(asked.take_due(moment(time)));
  }
  EXPECT_FALSE(asked.deadline());
}

TEST(AskedTopics, EachHasItsReadings) {
  AskedTopics asked;
  asked.ask("/a", moment(0ms));
  asked.ask("/b", moment(5ms));
  EXPECT_EQ("/a", asked.take_due(moment(0ms)));
  EXPECT_EQ(moment(5ms), asked.deadline());
  EXPECT_EQ("/b", asked.take_due(moment(5ms)));
  EXPECT_EQ(moment(10ms), asked.deadline());
  asked.ask("/b", moment(6ms));  // another publisher: from the beginning
  EXPECT_EQ("/b", asked.take_due(moment(6ms)));
  EXPECT_EQ("/a", asked.take_due(moment(10ms)));
  EXPECT_EQ(moment(16ms), asked.deadline());
}

}  // namespace
}  // namespace connect_bridge::ros
