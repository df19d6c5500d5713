#include "core/ports/follow_ups.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

TEST(FollowUps, EachIsDoneOnceInTheirOrder) {
  FollowUps all;
  all.add(FollowUp::kClaim);
  all.add(FollowUp::kRights);
  all.add(FollowUp::kOffers);
  all.add(FollowUp::kOffers);
  EXPECT_EQ(all.take(FollowUp::kClaim), FollowUp::kRights);
  EXPECT_EQ(all.take(FollowUp::kClaim), FollowUp::kOffers);
  EXPECT_EQ(all.take(FollowUp::kClaim), FollowUp::kClaim);
  EXPECT_EQ(all.take(FollowUp::kClaim), std::nullopt);
}

TEST(FollowUps, WhatIsBehindWaits) {
  FollowUps all;
  EXPECT_EQ(all.take(FollowUp::kOffers), std::nullopt);
  all.add(FollowUp::kClock);
  EXPECT_EQ(all.take(FollowUp::kOffers), std::nullopt);
  EXPECT_EQ(all.take(FollowUp::kClock), FollowUp::kClock);
}

}  // namespace
}  // namespace connect_bridge
