#include "ros/graph/reading_pace.hpp"

#include <gtest/gtest.h>

namespace connect_bridge::ros {
namespace {

using namespace std::chrono_literals;

TEST(ReadingPace, SomeReadingsComeAtOnceAndThenATenthOfTheTime) {
  ReadingPace pace;
  ReadingPace::TimePoint now{};
  for (int i = 0; i < ReadingPace::kAtOnce; ++i)
    EXPECT_EQ(pace.after(100ms, now += 100ms).usual, Duration::zero());
  Duration rested{};
  for (int i = 0; i < 100; ++i) {
    const Duration rest = pace.after(100ms, now += 100ms).usual;
    now += std::chrono::duration_cast<ReadingPace::TimePoint::duration>(rest);
    rested += rest;
  }
  EXPECT_GE(rested, 75s);
  EXPECT_LE(rested, 90s);
}

TEST(ReadingPace, WhatWasAskedForIsNotOwedLater) {
  ReadingPace pace;
  ReadingPace::TimePoint now{};
  for (int i = 0; i < 100; ++i) {
    const auto rest = pace.after(100ms, now += 100ms);
    EXPECT_LE(rest.usual, Duration{900ms});
    EXPECT_LE(rest.if_asked, Duration{300ms});
    now += std::chrono::duration_cast<ReadingPace::TimePoint::duration>(rest.if_asked);
  }
}

}  // namespace
}  // namespace connect_bridge::ros
