// What a side does with the listeners that its peers report.
#include <gtest/gtest.h>

#include <algorithm>

#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

ListenerReport listener(std::uint32_t number, std::string name) {
  ListenerReport told;
  told.listener = {number};
  told.name = std::move(name);
  told.type = kType;
  return told;
}
Listeners listening(std::uint32_t number, const std::string& name) {
  return {{listener(number, name)}, {}};
}

struct PeerListenersTest : testing::Test {
  PeerListenersTest() { s.join(1); }
  void listen(const Listeners& change) { s.say(1, change); }

  Script s{server({rule({"/cmd_vel/**", "/cmd_vel", "/fib/**"}, {"/scan"})})};
};

TEST_F(PeerListenersTest, ATopicThatSomebodyListensToIsSubscribedBeforeAnybodyPublishes) {
  listen(listening(1, "/cmd_vel"));
  EXPECT_EQ(s.did(), "subscribe 2 /cmd_vel reliable volatile 100\n");
  listen({{listener(2, "/cmd_vel")}, {}});
  listen({{}, {{1}}});
  EXPECT_EQ(s.did(), "");
  listen({{}, {{2}, {77}}});
  EXPECT_EQ(s.did(), "unsubscribe 2\n");
}

TEST_F(PeerListenersTest, WithoutARightItIsNot) {
  listen({{listener(1, "/scan"), listener(2, "/other"), listener(3, "no name"),
           listener(4, kClaimsTopic), listener(5, "/fib/_action/status")},
          {}});
  ListenerReport odd = listener(6, "/cmd_vel");
  odd.type = "no type";
  listen({{odd}, {}});
  EXPECT_EQ(s.did(), "");
}

TEST_F(PeerListenersTest, RightsComeAndGo) {
  listen({{listener(1, "/scan"), listener(2, "/cmd_vel")}, {}});
  EXPECT_EQ(s.did(), "subscribe 2 /cmd_vel reliable volatile 100\n");
  s.give(PolicyChanged{Policy({rule({"/scan"}, {})})});
  EXPECT_EQ(s.did(), "unsubscribe 2\nsubscribe 3 /scan reliable volatile 100\n");
  s.say(1, Accepts{{{{"/cmd_vel"}, {}}}, {}});
  EXPECT_EQ(s.did(), "unsubscribe 3\n");
}

// The subscription is made for the listener, and stays when the peer demands the topic.
TEST(PeerListeners, TheDepthOfARuleCountsFromTheFirstSubscription) {
  Rule deep = rule({"/cmd_vel"}, {});
  deep.treatment.qos.depth = 3000;
  Script s(server({deep}));
  s.join(1);
  s.say(1, listening(1, "/cmd_vel"));
  EXPECT_EQ(s.did(), "subscribe 2 /cmd_vel reliable volatile 3000\n");
}

// One link may tell of 1,024.
TEST(PeerListeners, TheListenersOfAnIdentityAreBounded) {
  auto options = server({rule({"/**"}, {})});
  options.links_max = 64;
  Script s(options);
  const auto links = static_cast<std::uint32_t>(Account::kListenersMax / 1024);
  for (std::uint32_t link = 1; link <= links; ++link) {
    s.join(link);
    Listeners many;
    for (std::uint32_t i = 1; i <= 1024; ++i) many.added.push_back(listener(i, "/a"));
    s.say(link, many);
  }
  EXPECT_EQ(s.logged.find("listeners for one identity"), std::string::npos);
  s.did();
  s.join(links + 1);
  s.say(links + 1, listening(1, "/b"));
  EXPECT_EQ(s.did(), "");
  EXPECT_NE(s.logged.find("listeners for one identity"), std::string::npos);
  s.lose(1);
  s.did();
  s.say(links + 1, listening(2, "/b"));
  EXPECT_EQ(s.did(), "subscribe 3 /b reliable volatile 100\n");
}

TEST_F(PeerListenersTest, TheyGoWithTheConnection) {
  listen(listening(1, "/cmd_vel"));
  s.did();
  s.lose(1);
  EXPECT_EQ(s.did(), "unsubscribe 2\n");
}

TEST_F(PeerListenersTest, TooManyEndTheConnection) {
  Listeners many;
  for (std::uint32_t i = 1; i <= 1024; ++i) many.added.push_back(listener(i, "/cmd_vel"));
  listen(many);
  EXPECT_EQ(s.did(), "subscribe 2 /cmd_vel reliable volatile 100\n");
  listen(listening(1025, "/cmd_vel"));
  EXPECT_NE(s.did().find("close 1 4006"), std::string::npos);
}

TEST_F(PeerListenersTest, ANumberInUseEndsTheConnection) {
  listen(listening(1, "/cmd_vel"));
  listen({{listener(1, "/cmd_vel")}, {{1}}});  // in its place
  listen(listening(1, "/cmd_vel"));
  EXPECT_NE(s.did().find("close 1 4009"), std::string::npos);
}

TEST_F(PeerListenersTest, TheFirstMessagesOfAPublisherWaitForTheDemand) {
  listen(listening(1, "/cmd_vel"));
  s.take(2, 7, "first");
  s.graph({topic("/cmd_vel").pub(7)});
  EXPECT_EQ(s.said(1), "offer 1/cmd_vel[1]\n");
  s.take(2, 7, "second");
  s.pass(400);
  EXPECT_EQ(s.said(1), "");
  s.demand(1, 1);
  EXPECT_EQ(s.said(1), "1.1 first, 1.1 second\n");
  EXPECT_EQ(s.did().find("unsubscribe"), std::string::npos);
}

TEST_F(PeerListenersTest, WhoEndsAtOnceIsHeardAllTheSame) {
  listen(listening(1, "/cmd_vel"));
  s.graph({topic("/cmd_vel").pub(7)});
  s.take(2, 7, "only");
  s.graph({});
  s.pass(600);
  EXPECT_EQ(s.said(1), "offer 1/cmd_vel[1]\n");
  s.demand(1, 1);
  EXPECT_EQ(s.said(1), "1.1 only\n");
}

TEST_F(PeerListenersTest, WithoutAListenerNothingIsKept) {
  s.graph({topic("/cmd_vel").pub(7)});
  s.demand(1, 1);
  s.demand(1, 1, false);
  s.said(1);
  s.take(2, 7, "lost");
  s.demand(1, 1);
  EXPECT_EQ(s.said(1), "");
}

TEST_F(PeerListenersTest, TheNextPublisherIsOfferedAnew) {
  listen(listening(1, "/cmd_vel"));
  s.graph({topic("/cmd_vel").pub(7)});
  s.demand(1, 1);
  s.graph({});
  s.pass(1000);
  EXPECT_EQ(s.said(1), "offer 1/cmd_vel[1]\nwithdraw 1\n");
  s.graph({topic("/cmd_vel").pub(8)});
  EXPECT_EQ(s.said(1), "offer 2/cmd_vel[2]\n");
  s.take(2, 8, "again");
  s.demand(1, 2);
  EXPECT_EQ(s.said(1), "2.2 again\n");
  EXPECT_EQ(s.did().find("unsubscribe"), std::string::npos);
}

TEST_F(PeerListenersTest, APublisherOfAnotherQosMakesItAnew) {
  listen(listening(1, "/cmd_vel"));
  s.did();
  s.logged.clear();
  s.graph({topic("/cmd_vel").pub(7, best_effort())});
  EXPECT_EQ(s.did(), "unsubscribe 2\nsubscribe 3 /cmd_vel best_effort volatile 100\n");
  EXPECT_EQ(s.logged, "");
}

TEST_F(PeerListenersTest, APublisherOfAnotherHashMakesItAnewUnlessNoneWasTold) {
  Topic published = topic("/cmd_vel").pub(7);
  published.type_hash = "RIHS01_b";
  listen(listening(1, "/cmd_vel"));
  s.graph({published});
  EXPECT_EQ(s.did(), "subscribe 2 /cmd_vel reliable volatile 100\n");
  s.graph({});
  s.pass(1000);
  listen({{}, {{1}}});
  ListenerReport other = listener(2, "/cmd_vel");
  other.type_hash = "RIHS01_a";
  listen({{other}, {}});
  EXPECT_EQ(s.did(), "unsubscribe 2\nsubscribe 3 /cmd_vel reliable volatile 100\n");
  s.graph({published});
  EXPECT_EQ(s.did(), "unsubscribe 3\nsubscribe 4 /cmd_vel reliable volatile 100\n");
}

TEST_F(PeerListenersTest, TheTypeIsThatOfThoseWhoAreHere) {
  Topic other = topic("/cmd_vel").pub(7);
  other.type = "p/msg/Other";
  listen(listening(1, "/cmd_vel"));
  EXPECT_EQ(s.did(), "subscribe 2 /cmd_vel reliable volatile 100\n");
  s.graph({other});
  EXPECT_EQ(s.did(), "unsubscribe 2\n");
  s.graph({});
  EXPECT_EQ(s.did(), "subscribe 3 /cmd_vel reliable volatile 100\n");
}

TEST_F(PeerListenersTest, OfTwoTypesTheFirstStands) {
  listen(listening(1, "/cmd_vel"));
  ListenerReport other = listener(2, "/cmd_vel");
  other.type = "p/msg/Other";
  listen({{other}, {}});
  EXPECT_EQ(s.did(), "subscribe 2 /cmd_vel reliable volatile 100\n");
}

TEST_F(PeerListenersTest, WhenTheTypesBeforeItLeaveTheLastOneStands) {
  Listeners many, gone;
  for (std::uint32_t n = 1; n <= 4; ++n) {
    many.added.push_back(listener(n, "/cmd_vel"));
    many.added.back().type = "p/msg/T" + std::to_string(n);
    if (n != 3) gone.removed.push_back({n});
  }
  listen(many);
  EXPECT_EQ(s.did(), "subscribe 2 /cmd_vel reliable volatile 100\n");
  listen(gone);
  EXPECT_EQ(s.did(), "unsubscribe 2\nsubscribe 3 /cmd_vel reliable volatile 100\n");
  listen({{}, {{3}}});
  EXPECT_EQ(s.did(), "unsubscribe 3\n");
}

TEST_F(PeerListenersTest, ATypeThatIsNotThere) {
  listen(listening(1, "/cmd_vel"));
  s.did();
  s.give(SubscriptionFailed{{2}, "type_unknown", "not installed"});
  listen({{}, {{1}}});
  EXPECT_EQ(s.did(), "");
  listen(listening(2, "/cmd_vel"));
  EXPECT_EQ(s.did(), "subscribe 3 /cmd_vel reliable volatile 100\n");
}

TEST_F(PeerListenersTest, AnotherTypeTakesThePlaceOfOneThatIsNotThere) {
  listen(listening(1, "/cmd_vel"));
  ListenerReport other = listener(2, "/cmd_vel");
  other.type = "p/msg/Other";
  listen({{other}, {}});
  s.did();
  s.give(SubscriptionFailed{{2}, "type_unknown", "not installed"});
  EXPECT_EQ(s.did(), "subscribe 3 /cmd_vel reliable volatile 100\n");
}

// A peer that names a thousand types keeps no line of others out of the log.
TEST_F(PeerListenersTest, WhatTheyMakeThisSideSayIsToldForTheirIdentity) {
  for (std::uint32_t n = 1; n <= LoggedOnce::kLoggedMax + 1; ++n)
    listen(listening(n, "/cmd_vel/x" + std::to_string(n)));
  s.did();
  for (std::uint32_t n = 2; n <= LoggedOnce::kLoggedMax + 2; ++n)
    s.give(SubscriptionFailed{{n}, "type_unknown", "not installed"});
  s.did();
  s.logged.clear();
  s.give(QosIncompatible{{}, "/a", "reliability"});
  s.did();
  EXPECT_NE(s.logged.find("/a: a publisher here offers"), std::string::npos) << s.logged;
}

// A peer whose listeners come and go creates no more subscriptions than that.
TEST(FarListenersPace, ThoseThatComeTooOftenCountLater) {
  auto options = server();
  options.account.mirrors_at_once = 2;
  options.account.mirror_period = std::chrono::milliseconds(50);
  Script s(std::move(options));
  s.join(1);
  Listeners many;
  for (std::uint32_t i = 1; i <= 5; ++i)
    many.added.push_back(listener(i, "/t" + std::to_string(i)));
  s.say(1, many);
  EXPECT_EQ(s.did(),
            "subscribe 2 /t1 reliable volatile 100\nsubscribe 3 /t2 reliable volatile 100\n");
  s.say(1, Listeners{{}, {{3}}});  // it never counted
  EXPECT_EQ(s.did(), "");
  s.pass(100);
  EXPECT_EQ(s.did(),
            "subscribe 4 /t4 reliable volatile 100\nsubscribe 5 /t5 reliable volatile 100\n");
  s.say(1, Listeners{{listener(6, "/t6")}, {{1}}});
  s.lose(1);
  s.pass(1000);
  EXPECT_EQ(s.did().find("/t6"), std::string::npos);
}

// Topics that nobody publishes here and that link `connection` listens to, numbered from `first`
// on.
void invent(Script& s, std::uint32_t connection, std::uint32_t first, std::uint32_t count) {
  for (std::uint32_t i = first; i < first + count; i += kAddedMax) {
    Listeners many;
    for (std::uint32_t n = i; n < std::min<std::uint32_t>(i + kAddedMax, first + count); ++n)
      many.added.push_back(listener(n, "/t" + std::to_string(n)));
    s.say(connection, many);
  }
  s.pass(2000);
}

TEST(FarListenersPlaces, OfWhatNobodyPublishesAnIdentityHasSoMany) {
  Script s(server());
  s.login(1, {}, called("busy"));
  s.login(2, {}, called("busy"));
  for (const std::uint32_t link : {1U, 2U}) s.say(link, Accepts{{{{"/**"}, {}}}, {}});
  s.did();
  invent(s, 1, 1000, 200);
  invent(s, 2, 2000, 200);
  EXPECT_EQ(times(s.did(), "subscribe"), 256);
  EXPECT_EQ(times(s.logged, "at most 256 topics for one identity"), 1);
  // What is published here needs none, also for who has all of its places.
  s.graph({topic("/t2199").pub(7)});
  EXPECT_NE(s.did().find("/t2199 "), std::string::npos);
  // A place that is free goes to one that waits.
  s.say(1, Listeners{{}, {{1000}}});
  s.pass(100);
  const std::string did = s.did();
  EXPECT_EQ(times(did, "unsubscribe"), 1) << did;
  EXPECT_EQ(times(did, "\nsubscribe"), 1) << did;
  s.lose(1);
  s.pass(2000);
  EXPECT_EQ(times(s.did(), "\nsubscribe"), 142);
}

TEST(FarListenersPlaces, NoIdentityHasMoreThanItLeavesToOthers) {
  Script s(server());
  std::int64_t all = 0;
  for (std::uint32_t n = 1; n <= 5; ++n) {
    s.login(n, {}, called("peer" + std::to_string(n)));
    s.say(n, Accepts{{{{"/**"}, {}}}, {}});
    s.did();
    invent(s, n, n * 1000, 300);
    const std::int64_t made = times(s.did(), "subscribe");
    EXPECT_GE(made, 60) << n;
    EXPECT_LE(made, 256) << n;
    all += made;
  }
  EXPECT_LE(all, 1024);
}

TEST(FarListenersPlaces, OneThatIsSharedStaysWithThoseWhoAreLeft) {
  Script s(server());
  s.join(1);
  s.join(2);
  for (const std::uint32_t link : {1U, 2U}) s.say(link, listening(1, "/t"));
  EXPECT_EQ(times(s.did(), "subscribe"), 1);
  s.lose(1);
  EXPECT_EQ(times(s.did(), "subscribe"), 0);
  s.lose(2);
  EXPECT_EQ(times(s.did(), "unsubscribe"), 1);
}

TEST(FarListenersPlaces, ATopicWhosePublishersEndNeedsOne) {
  Script s(server());
  s.login(1, {}, called("busy"));
  s.say(1, Accepts{{{{"/**"}, {}}}, {}});
  s.graph({topic("/t").pub(7)});
  s.say(1, listening(1, "/t"));
  invent(s, 1, 1000, 256);
  s.did();
  s.graph({});
  s.pass(3000);
  EXPECT_EQ(s.did(), "unsubscribe 2\n");
  s.say(1, Listeners{{}, {{1000}}});
  s.pass(100);
  EXPECT_NE(s.did().find(" /t reliable"), std::string::npos);
}

// Early samples are of what all peers together may make a side hold.
TEST(FarListenersShare, WithoutRoomNothingIsKept) {
  auto options = server();
  options.account.memory_bytes_max = 3000;
  Script s(std::move(options));
  s.join(1);
  s.say(1, listening(1, "/cmd_vel"));
  s.graph({topic("/cmd_vel").pub(7)});
  s.take(2, 7, std::string(1000, 'x'));
  EXPECT_EQ(s.status().shared_bytes, 1004U);
  s.take(2, 7, std::string(1500, 'y'));
  EXPECT_EQ(s.dropped(DropReason::kMemory), 1U);
  s.demand(1, 1);
  s.said(1);
  s.acknowledge(1);
  EXPECT_EQ(s.status().shared_bytes, 0U);
}

}  // namespace
}  // namespace connect_bridge::side_test
