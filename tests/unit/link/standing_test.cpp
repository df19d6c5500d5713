#include "core/link/standing.hpp"

#include <gtest/gtest.h>

#include "unit/link/quiet_user.hpp"
#include "unit/topics/one_link.hpp"

namespace connect_bridge::topics_test {
namespace {

struct Anybody final : link_test::QuietUser {};

TEST(Standing, TheLogTellsWhatWasBeforeAConnection) {
  OneLink one;
  Link& link = one.link;
  const Peer same = link.connection()->peer();
  Anybody anybody;
  EXPECT_EQ(past_of(Link({2}, anybody), same, true), "");

  Peer other = same;
  other.session.bytes[0] = 3;
  EXPECT_EQ(past_of(link, same, true), "; it resumes after a break");
  EXPECT_EQ(past_of(link, other, true), "; the server has not kept what was under way");
  EXPECT_EQ(past_of(link, other, false), "; it starts again, nothing had to be kept");
  link.life.forgotten(true);
  EXPECT_EQ(past_of(link, other, true), "; the break was longer than resume.seconds");
  EXPECT_FALSE(is_replaced(link, other));

  Peer successor = same;
  successor.side.bytes[0] = 4;
  EXPECT_TRUE(is_replaced(link, successor));
  EXPECT_EQ(past_of(link, successor, true), "; it was started again");
}

}  // namespace
}  // namespace connect_bridge::topics_test
