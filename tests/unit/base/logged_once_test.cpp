#include "core/base/logged_once.hpp"

#include <gtest/gtest.h>

#include <string>

namespace connect_bridge {
namespace {

TEST(LoggedOnce, TheSecondTimeIsNotLogged) {
  LoggedOnce logged;
  EXPECT_TRUE(logged.first("a"));
  EXPECT_TRUE(logged.first("b"));
  EXPECT_FALSE(logged.first("a"));
}

TEST(LoggedOnce, IsBounded) {
  LoggedOnce logged;
  for (std::size_t i = 0; i < LoggedOnce::kLoggedMax; ++i)
    EXPECT_TRUE(logged.first(std::to_string(i)));
  EXPECT_FALSE(logged.first("one more"));
}

TEST(LoggedOnce, IsNotFullForEver) {
  LoggedOnce logged;
  const auto after = [](auto time) { return Now{TimePoint{} + time, 0, 0}; };
  for (std::size_t i = 0; i < LoggedOnce::kLoggedMax; ++i)
    EXPECT_TRUE(logged.first(std::to_string(i)));
  logged.on_time(after(std::chrono::seconds(1)));
  logged.on_time(after(std::chrono::minutes(15)));
  EXPECT_FALSE(logged.first("later"));
  logged.on_time(after(std::chrono::minutes(16)));
  EXPECT_TRUE(logged.first("later"));
}

}  // namespace
}  // namespace connect_bridge
