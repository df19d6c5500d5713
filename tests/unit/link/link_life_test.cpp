// What a lost link waits for, and when it ends.
#include "core/link/link_life.hpp"

#include <gtest/gtest.h>

#include "unit/link/script.hpp"

namespace connect_bridge::link_test {
namespace {

constexpr Duration kTenSeconds = std::chrono::seconds(10);

TimePoint after(std::int64_t ms) {
  return now_ms(ms).steady;
}

LinkLife open_link() {
  LinkLife life(kTenSeconds);
  life.opened(now_ms(0));
  return life;
}

TEST(LinkLife, OffersOfAConnectionEndOnce) {
  LinkLife life = open_link();
  EXPECT_EQ(life.deadline(), after(30'000));
  EXPECT_FALSE(life.take_offers_end(now_ms(29'999)));
  EXPECT_TRUE(life.take_offers_end(now_ms(30'000)));
  EXPECT_FALSE(life.take_offers_end(now_ms(30'001)));
  life.opened(now_ms(40'000));
  life.lost(Loss::kBreak, after(43'000), now_ms(41'000));
  EXPECT_FALSE(life.take_offers_end(now_ms(80'000)));
  EXPECT_EQ(life.connects(), 2U);
}

TEST(LinkLife, ABrokenLinkIsDeadAfterSilenceAndForgottenAfterWhatIsKept) {
  LinkLife life = open_link();
  life.lost(Loss::kBreak, after(3000), now_ms(1000));
  EXPECT_TRUE(life.waits_alive());
  EXPECT_TRUE(life.may_return());
  EXPECT_FALSE(life.is_to_die(now_ms(2999)));
  EXPECT_TRUE(life.is_to_die(now_ms(3000)));
  life.died(true, now_ms(3000));
  EXPECT_FALSE(life.waits_alive());
  EXPECT_FALSE(life.is_to_be_forgotten(now_ms(10'999)));
  EXPECT_TRUE(life.is_to_be_forgotten(now_ms(11'000)));
  life.forgotten(true);
  EXPECT_FALSE(life.waits());
  EXPECT_TRUE(life.outlasted());
  EXPECT_FALSE(life.deadline());
  life.opened(now_ms(20'000));
  EXPECT_FALSE(life.outlasted());
}

TEST(LinkLife, WithNothingToGoOnWithADeadLinkIsForgottenAtOnce) {
  LinkLife life = open_link();
  life.lost(Loss::kSilence, after(3000), now_ms(3000));
  EXPECT_TRUE(life.may_return());
  EXPECT_TRUE(life.is_to_die(now_ms(3000)));
  life.died(false, now_ms(3000));
  EXPECT_TRUE(life.is_to_be_forgotten(now_ms(3000)));
}

TEST(LinkLife, ALostLinkThatIsGivenUpEndsAtOnce) {
  LinkLife life = open_link();
  life.lost(Loss::kBreak, after(3000), now_ms(1000));
  life.give_up(now_ms(2000));
  EXPECT_FALSE(life.may_return());
  EXPECT_TRUE(life.is_to_die(now_ms(2000)));
  EXPECT_TRUE(life.is_to_be_forgotten(now_ms(2000)));
}

}  // namespace
}  // namespace connect_bridge::link_test
