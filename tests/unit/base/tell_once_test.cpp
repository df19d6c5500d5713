#include "core/base/tell_once.hpp"

#include <gtest/gtest.h>

#include <string>

namespace connect_bridge {
namespace {

TEST(TellOnce, TheSecondTimeIsNotTold) {
  TellOnce told;
  EXPECT_TRUE(told.first("a"));
  EXPECT_TRUE(told.first("b"));
  EXPECT_FALSE(told.first("a"));
}

TEST(TellOnce, IsBounded) {
  TellOnce told;
  for (std::size_t i = 0; i < TellOnce::kToldMax; ++i) EXPECT_TRUE(told.first(std::to_string(i)));
  EXPECT_FALSE(told.first("one more"));
}

TEST(TellOnce, IsNotFullForEver) {
  TellOnce told;
  const auto after = [](auto time) { return Now{TimePoint{} + time, 0, 0}; };
  for (std::size_t i = 0; i < TellOnce::kToldMax; ++i) EXPECT_TRUE(told.first(std::to_string(i)));
  told.on_time(after(std::chrono::seconds(1)));
  told.on_time(after(std::chrono::minutes(15)));
  EXPECT_FALSE(told.first("later"));
  told.on_time(after(std::chrono::minutes(16)));
  EXPECT_TRUE(told.first("later"));
}

}  // namespace
}  // namespace connect_bridge
