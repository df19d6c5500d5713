// Whether a service has a server, while its endpoints come and go one by one.
#include "ros/services/server_sight.hpp"

#include <gtest/gtest.h>

namespace connect_bridge::ros {
namespace {

using namespace std::chrono_literals;

constexpr ServerSight::Time kStart{1h};

TEST(ServerSight, TheFirstServerIsBelievedAtOnce) {
  ServerSight sight;
  EXPECT_FALSE(sight.look(false, true, kStart));
  EXPECT_FALSE(sight.is_ready());
  EXPECT_TRUE(sight.is_alone());
  EXPECT_FALSE(sight.next_look());
  EXPECT_TRUE(sight.look(true, true, kStart + 1ms));
  EXPECT_TRUE(sight.is_ready());
  EXPECT_FALSE(sight.is_alone());
}

TEST(ServerSight, OneThatLeftTheGraphIsGoneAfterAMoment) {
  ServerSight sight;
  sight.look(true, true, kStart);
  EXPECT_FALSE(sight.look(false, false, kStart));
  EXPECT_EQ(sight.next_look(), ServerSight::kPatience / 3);
  EXPECT_FALSE(sight.look(false, false, kStart + ServerSight::kPatience - 1ms));
  EXPECT_TRUE(sight.is_ready());
  EXPECT_TRUE(sight.look(false, false, kStart + ServerSight::kPatience));
  EXPECT_FALSE(sight.is_ready());
  EXPECT_FALSE(sight.next_look());
}

// A second server comes, and is known by half for seconds: the first one works all the time.
TEST(ServerSight, HalfOfAnotherServerHidesNone) {
  ServerSight sight;
  sight.look(true, true, kStart);
  for (auto now = kStart; now < kStart + 5s; now += 100ms)
    EXPECT_FALSE(sight.look(false, true, now));
  EXPECT_TRUE(sight.is_ready());
  EXPECT_FALSE(sight.look(true, true, kStart + 5s));
  EXPECT_FALSE(sight.is_alone());
  // A later half has the whole time again.
  EXPECT_FALSE(sight.look(false, true, kStart + 11s));
  EXPECT_TRUE(sight.is_ready());
}

TEST(ServerSight, HalfAServerIsNoneInTheEnd) {
  ServerSight sight;
  sight.look(true, true, kStart);
  EXPECT_FALSE(sight.look(false, true, kStart));
  ASSERT_TRUE(sight.next_look());
  EXPECT_LE(*sight.next_look(), ServerSight::kPatienceInGraph);
  EXPECT_TRUE(sight.look(false, true, kStart + ServerSight::kPatienceInGraph));
  EXPECT_FALSE(sight.is_ready());
}

TEST(ServerSight, WhatLeavesTheGraphByHalvesIsGoneWithTheLast) {
  ServerSight sight;
  sight.look(true, true, kStart);
  EXPECT_FALSE(sight.look(false, true, kStart + 1s));
  EXPECT_FALSE(sight.look(false, true, kStart + 2s));
  EXPECT_TRUE(sight.look(false, false, kStart + 3s));
}

}  // namespace
}  // namespace connect_bridge::ros
