// When many messages of a topic count as lost in the middleware here.
#include "core/topics/recent_loss.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

using namespace std::chrono_literals;

constexpr TimePoint kStart{1000h};

// So many of ten messages are lost in each second, up to this one.
RecentLoss losing(std::uint64_t lost, int seconds) {
  RecentLoss loss;
  for (int second = 0; second < seconds; ++second) {
    loss.lost(lost, kStart + std::chrono::seconds(second));
    for (std::uint64_t n = lost; n < 10; ++n) loss.took();
  }
  return loss;
}

TEST(RecentLoss, ALossThatGoesOnIsSaidUntilAWhileAfterIt) {
  EXPECT_EQ(losing(4, 2).much_until(), TimePoint{});
  EXPECT_EQ(losing(4, 3).much_until(), kStart + 32s);
  EXPECT_EQ(losing(4, 290).much_until(), kStart + 289s + 30s);
}

TEST(RecentLoss, AFewAreNotMany) {
  EXPECT_EQ(losing(2, 300).much_until(), TimePoint{});
  EXPECT_EQ(losing(1, 3).much_until(), TimePoint{});
}

// As many messages as the middleware has no room for while nobody takes them.
TEST(RecentLoss, AMomentIsOver) {
  RecentLoss loss;
  for (int n = 0; n < 500; ++n) loss.lost(1, kStart + std::chrono::milliseconds(n));
  EXPECT_EQ(loss.much_until(), TimePoint{});
  for (int n = 0; n < 100; ++n) loss.took();
  loss.lost(500, kStart + 70s);
  EXPECT_EQ(loss.much_until(), TimePoint{});
}

}  // namespace
}  // namespace connect_bridge
