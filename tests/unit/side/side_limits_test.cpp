// Limits of peers that an operator sets, each reached.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "unit/side/script.hpp"
#include "unit/topics/one_link.hpp"

namespace connect_bridge::side_test {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(Limits, WhatAPeerTakesBackHasTheRateThatIsSet) {
  SideOptions options = server({everything()});
  options.account.ends_per_second = 2;
  Script s(options);
  s.graph({topic("/a").pub(1)});
  s.join(1);
  const auto change_demand = [&] {
    s.demand(1, 1, true);
    s.demand(1, 1, false);
    return s.did();
  };
  for (int n = 0; n < 264; ++n) EXPECT_THAT(change_demand(), Not(HasSubstr("close 1 4006")));
  EXPECT_THAT(change_demand(), HasSubstr("close 1 4006"));
}

TEST(Limits, SoHaveAttachmentsAndDemandsOfAllLinksOfAnIdentity) {
  AccountOptions options;
  options.ends_per_second = 10;
  Account account(options);
  const TimePoint begin = topics_test::ms(1000).steady;
  for (int n = 0; n < 120; ++n) EXPECT_TRUE(account.attaches.take(begin));
  EXPECT_FALSE(account.attaches.take(begin));
  EXPECT_TRUE(account.attaches.take(begin + std::chrono::milliseconds(500)));
  for (int n = 0; n < 1320; ++n) EXPECT_TRUE(account.demands.take(begin));
  EXPECT_FALSE(account.demands.take(begin));
  EXPECT_TRUE(account.demands.take(begin + std::chrono::milliseconds(100)));
}

// All nodes of the largest graph that may be offered end and come again, ten times within a minute:
// its channels, the demands for them, its listeners, and mirrors' origins.
TEST(Limits, TheLargestGraphMayComeAgainTenTimesAMinute) {
  Account account;
  const TimePoint begin = topics_test::ms(1000).steady;
  constexpr int kEnds = 4096 + 1024 + 2048;
  for (int again = 0; again < 10; ++again) {
    for (int n = 0; n < kEnds; ++n) ASSERT_TRUE(account.withdrawals.take(begin));
    for (int n = 0; n < 4096; ++n) ASSERT_TRUE(account.demands.take(begin));
  }
}

// What fits stays; what does not is said once, and comes when others leave.
TEST(Limits, BeyondThePlacesOfALinkWhatFitsStays) {
  Script s(server({everything()}));
  std::vector<Topic> topics;
  for (int i = 0; i < 4100; ++i) topics.push_back(topic("/t" + std::to_string(i)).pub(1));
  s.graph(topics);
  s.login(1);
  s.said(1);
  s.say(1, Accepts{{{{"/**"}, {}, {"/**"}, {"/**"}, {"/**"}}}, {}});
  s.pass(1);
  EXPECT_EQ(times(s.said(1), "/t"), 4096);
  s.did();
  EXPECT_EQ(times(s.logged, "not all interfaces"), 1);
  topics.erase(topics.begin(), topics.begin() + 10);
  s.graph(topics);
  s.pass(2000);
  const std::string said = s.said(1);
  EXPECT_EQ(times(said, "withdraw "), 10);
  EXPECT_EQ(times(said, "/t"), 4);
  EXPECT_EQ(times(s.did(), "close "), 0);
  EXPECT_EQ(times(s.logged, "not all interfaces"), 1);
}

// ---- counts

TEST(Limits, PublishersThatWaitForTheirPaceAreCounted) {
  SideOptions options = server();
  options.account.mirrors_at_once = 2;
  Script s(options);
  s.graph({});
  s.pass(3000);
  s.login(1, {}, called("busy"));
  s.say(1, Accepts{});
  std::vector<OriginOffer> origins;
  for (std::uint8_t i = 1; i <= 5; ++i) origins.push_back(origin(i, i));
  s.say(1, Offer{{channel(1, "/a", origins)}, true});
  EXPECT_EQ(s.status().links.at(0).mirrors_waited, 3U);
  s.pass(3000);
  EXPECT_EQ(s.status().links.at(0).mirrors_waited, 3U) << "each is counted once";
}

TEST(Limits, LoginsThatTimedOutOrFoundNoPlaceAreCounted) {
  SideOptions options = server();
  options.links_max = 1;
  Script s(options);
  s.give(ConnectionOpened{{1}, "10.0.0.9:5", "10.0.0.9", 1});
  s.pass(5000);
  EXPECT_THAT(s.did(), HasSubstr("close 1 4004"));
  EXPECT_EQ(s.status().strangers.login_timeouts, 1U);
  s.login(2);
  s.did();
  EXPECT_EQ(s.status().strangers.logins_without_place, 0U);
  s.give(ConnectionOpened{{3}, "10.0.0.9:6", "10.0.0.9", 1});
  s.binary(3, encode(Hello{1, 1, Script::peer_id(3), {}, "/peer"}));
  s.binary(3, encode(Login{"none", {}}));
  s.give(Authenticated{{3}, Identity{}, ""});
  EXPECT_THAT(s.did(), HasSubstr("close 3 4012"));
  EXPECT_EQ(s.status().strangers.logins_without_place, 1U);
}

// ---- what a peer accepts

// However long a list may be, all that is here is compared with it at once.
TEST(Limits, TheLongestListIsComparedAtOnce) {
  Script s(server());
  std::vector<Topic> topics;
  for (int i = 1; i <= 40; ++i) topics.push_back(topic("/t" + std::to_string(i)).pub(1));
  s.graph(topics);
  s.login(1, {}, called("busy"));
  s.said(1);
  Accepts longest{{{{"/**"}, {}}}, {"/t1"}};
  while (size_of(longest).wildcards < kWildcardsMax) longest.deny.push_back("/x/*aaaaaaaaaaaaa");
  while (size_of(longest).entries < kAcceptEntriesMax)
    longest.deny.push_back("/x" + std::string(55, 'y'));
  s.say(1, longest);
  const std::string said = s.said(1);
  EXPECT_THAT(said, HasSubstr("/t40["));
  EXPECT_THAT(said, testing::Not(HasSubstr("/t1[")));
  longest.deny[0] = "/t2";
  s.say(1, longest);
  EXPECT_THAT(s.said(1), testing::MatchesRegex("withdraw [0-9]+\noffer [0-9]+/t1\\[1\\]\n"));
  longest.deny.push_back("/one/more");
  s.say(1, longest);
  EXPECT_THAT(s.did(), HasSubstr("close 1 4006"));
}

}  // namespace
}  // namespace connect_bridge::side_test
