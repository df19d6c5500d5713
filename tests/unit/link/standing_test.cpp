#include "core/link/standing.hpp"

#include <gtest/gtest.h>

#include "unit/topics/one_link.hpp"

namespace connect_bridge::topics_test {
namespace {

TEST(Standing, TheLogTellsWhatWasBeforeAConnection) {
  OneLink one;
  Link& link = one.link;
  Peer same;
  same.side.bytes[0] = 2;
  same.session.bytes[0] = 1;
  link.login.set_session(same.session);
  Peer other = same;
  other.session.bytes[0] = 3;
  EXPECT_EQ(past_of(link, same, true), "");

  link.connects = 1;
  link.peer_side = same.side;
  EXPECT_EQ(past_of(link, same, true), "; it goes on after a break");
  EXPECT_EQ(past_of(link, other, true), "; the server has not kept what was under way");
  EXPECT_EQ(past_of(link, other, false), "; it starts again, nothing had to be kept");
  link.outlasted = true;
  EXPECT_EQ(past_of(link, other, true), "; the break was longer than resume.seconds");
  EXPECT_FALSE(is_replaced(link, other));

  link.peer_side.bytes[0] = 4;
  EXPECT_TRUE(is_replaced(link, same));
  EXPECT_EQ(past_of(link, same, true), "; it was started again");
}

}  // namespace
}  // namespace connect_bridge::topics_test
