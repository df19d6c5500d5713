// What a side does with the listeners that its peers report.
#include <gtest/gtest.h>

#include <algorithm>

#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

// What each that counts holds of memory_max.
constexpr std::uint64_t kListenerBytes = 20 << 10;

ListenerTold listener(std::uint32_t number, std::string name, std::string node = "/base") {
  ListenerTold told;
  told.listener = {number};
  told.name = std::move(name);
  told.type = kType;
  told.node = std::move(node);
  told.qos = qos();
  return told;
}
Listeners listening(std::uint32_t number, const std::string& name) {
  return {{listener(number, name)}, {}};
}

struct FarListenersTest : testing::Test {
  FarListenersTest() { s.join(1); }
  void listen(const Listeners& change) { s.say(1, change); }

  Script s{server({rule({"/cmd_vel/**", "/cmd_vel", "/fib/**"}, {"/scan"})})};
};

TEST_F(FarListenersTest, ATopicThatSomebodyListensToIsSubscribedBeforeAnybodyPublishes) {
  listen(listening(1, "/cmd_vel"));
  EXPECT_EQ(s.did(), "subscribe 2 /cmd_vel reliable volatile 100\n");
  listen({{listener(2, "/cmd_vel", "/arm")}, {}});
  listen({{}, {{1}}});
  EXPECT_EQ(s.did(), "");
  listen({{}, {{2}, {77}}});
  EXPECT_EQ(s.did(), "unsubscribe 2\n");
}

TEST_F(FarListenersTest, WithoutARightItIsNot) {
  listen({{listener(1, "/scan"), listener(2, "/other"), listener(3, "no name"),
           listener(4, kClaimsTopic), listener(5, "/fib/_action/status")},
          {}});
  ListenerTold odd = listener(6, "/cmd_vel");
  odd.type = "no type";
  listen({{odd}, {}});
  EXPECT_EQ(s.did(), "");
}

TEST_F(FarListenersTest, RightsComeAndGo) {
  listen({{listener(1, "/scan"), listener(2, "/cmd_vel")}, {}});
  EXPECT_EQ(s.did(), "subscribe 2 /cmd_vel reliable volatile 100\n");
  s.give(PolicyChanged{Policy({rule({"/scan"}, {})})});
  EXPECT_EQ(s.did(), "unsubscribe 2\nsubscribe 3 /scan reliable volatile 100\n");
  s.say(1, Accepts{{{{"/cmd_vel"}, {}}}, {}});
  EXPECT_EQ(s.did(), "unsubscribe 3\n");
}

TEST_F(FarListenersTest, TheyGoWithTheConnection) {
  listen(listening(1, "/cmd_vel"));
  s.did();
  s.lose(1);
  EXPECT_EQ(s.did(), "unsubscribe 2\n");
}

TEST_F(FarListenersTest, TooManyEndTheConnection) {
  Listeners many;
  for (std::uint32_t i = 1; i <= 1024; ++i) many.added.push_back(listener(i, "/cmd_vel"));
  listen(many);
  EXPECT_EQ(s.did(), "subscribe 2 /cmd_vel reliable volatile 100\n");
  listen(listening(1025, "/cmd_vel"));
  EXPECT_NE(s.did().find("close 1 4006"), std::string::npos);
}

TEST_F(FarListenersTest, ANumberInUseEndsTheConnection) {
  listen(listening(1, "/cmd_vel"));
  listen({{listener(1, "/cmd_vel", "/arm")}, {{1}}});  // in its place
  listen(listening(1, "/cmd_vel"));
  EXPECT_NE(s.did().find("close 1 4009"), std::string::npos);
}

TEST_F(FarListenersTest, TheFirstMessagesOfAPublisherWaitForTheDemand) {
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

TEST_F(FarListenersTest, ForTwoSecondsAtMost) {
  listen(listening(1, "/cmd_vel"));
  s.graph({topic("/cmd_vel").pub(7)});
  s.take(2, 7, "old");
  s.pass(2001);
  EXPECT_EQ(s.dropped(DropReason::kNoDemand), 1U);
  s.take(2, 7, "not kept");
  s.said(1);
  s.demand(1, 1);
  EXPECT_EQ(s.said(1), "");
  s.take(2, 7, "new");
  EXPECT_EQ(s.said(1), "1.1 new\n");
}

TEST_F(FarListenersTest, TheNewestHundredAreKept) {
  listen(listening(1, "/cmd_vel"));
  s.graph({topic("/cmd_vel").pub(7)});
  for (int i = 1; i <= 101; ++i) s.take(2, 7, "m" + std::to_string(i));
  s.take(2, 7, std::string((1 << 20) + 1, 'x'));
  EXPECT_EQ(s.dropped(DropReason::kQueueDepth), 1U);
  EXPECT_EQ(s.dropped(DropReason::kQueueBytes), 1U);
  s.said(1);
  s.demand(1, 1);
  EXPECT_EQ(s.said(1).substr(0, 7), "1.1 m2,");
}

TEST_F(FarListenersTest, WhoEndsAtOnceIsHeardAllTheSame) {
  listen(listening(1, "/cmd_vel"));
  s.graph({topic("/cmd_vel").pub(7)});
  s.take(2, 7, "only");
  s.graph({});
  s.pass(600);
  EXPECT_EQ(s.said(1), "offer 1/cmd_vel[1]\n");
  s.demand(1, 1);
  EXPECT_EQ(s.said(1), "1.1 only\n");
}

TEST_F(FarListenersTest, WithoutAListenerNothingIsKept) {
  s.graph({topic("/cmd_vel").pub(7)});
  s.demand(1, 1);
  s.demand(1, 1, false);
  s.said(1);
  s.take(2, 7, "lost");
  s.demand(1, 1);
  EXPECT_EQ(s.said(1), "");
}

TEST_F(FarListenersTest, TheNextPublisherIsOfferedAnew) {
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

TEST_F(FarListenersTest, APublisherOfAnotherQosMakesItAnew) {
  listen(listening(1, "/cmd_vel"));
  s.did();
  s.logged.clear();
  s.graph({topic("/cmd_vel").pub(7, best_effort())});
  EXPECT_EQ(s.did(), "unsubscribe 2\nsubscribe 3 /cmd_vel best_effort volatile 100\n");
  EXPECT_EQ(s.logged, "");
}

TEST_F(FarListenersTest, APublisherOfAnotherHashMakesItAnewUnlessNoneWasTold) {
  Topic published = topic("/cmd_vel").pub(7);
  published.type_hash = "RIHS01_b";
  listen(listening(1, "/cmd_vel"));
  s.graph({published});
  EXPECT_EQ(s.did(), "subscribe 2 /cmd_vel reliable volatile 100\n");
  s.graph({});
  s.pass(1000);
  listen({{}, {{1}}});
  ListenerTold other = listener(2, "/cmd_vel");
  other.type_hash = "RIHS01_a";
  listen({{other}, {}});
  EXPECT_EQ(s.did(), "unsubscribe 2\nsubscribe 3 /cmd_vel reliable volatile 100\n");
  s.graph({published});
  EXPECT_EQ(s.did(), "unsubscribe 3\nsubscribe 4 /cmd_vel reliable volatile 100\n");
}

TEST_F(FarListenersTest, TheTypeIsThatOfThoseWhoAreHere) {
  Topic other = topic("/cmd_vel").pub(7);
  other.type = "p/msg/Other";
  listen(listening(1, "/cmd_vel"));
  EXPECT_EQ(s.did(), "subscribe 2 /cmd_vel reliable volatile 100\n");
  s.graph({other});
  EXPECT_EQ(s.did(), "unsubscribe 2\n");
  s.graph({});
  EXPECT_EQ(s.did(), "subscribe 3 /cmd_vel reliable volatile 100\n");
}

TEST_F(FarListenersTest, OfTwoTypesTheFirstStands) {
  listen(listening(1, "/cmd_vel"));
  ListenerTold other = listener(2, "/cmd_vel");
  other.type = "p/msg/Other";
  listen({{other}, {}});
  EXPECT_EQ(s.did(), "subscribe 2 /cmd_vel reliable volatile 100\n");
}

TEST_F(FarListenersTest, WhenTheTypesBeforeItLeaveTheLastOneStands) {
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

// When one leaves, the others are looked at.
TEST_F(FarListenersTest, OfANameFewTypesCount) {
  Listeners many;
  for (std::uint32_t n = 1; n <= 5; ++n) {
    many.added.push_back(listener(n, "/cmd_vel"));
    many.added.back().type = "p/msg/T" + std::to_string(n);
  }
  listen(many);
  listen({{}, {{1}, {2}, {3}, {4}}});
  EXPECT_EQ(s.did(), "subscribe 2 /cmd_vel reliable volatile 100\nunsubscribe 2\n");
  EXPECT_NE(s.logged.find("a name has too many types"), std::string::npos) << s.logged;
  s.pass(2000);  // now it may
  EXPECT_EQ(s.did(), "subscribe 3 /cmd_vel reliable volatile 100\n");
}

TEST_F(FarListenersTest, ATypeThatIsNotThere) {
  listen(listening(1, "/cmd_vel"));
  s.did();
  s.give(SubscriptionFailed{{2}, "type_unknown", "not installed"});
  listen({{}, {{1}}});
  EXPECT_EQ(s.did(), "");
  listen(listening(2, "/cmd_vel"));
  EXPECT_EQ(s.did(), "subscribe 3 /cmd_vel reliable volatile 100\n");
}

// A peer that names a thousand types keeps no line of others out of the log.
TEST_F(FarListenersTest, WhatTheyMakeThisSideSayIsToldForTheirIdentity) {
  for (std::uint32_t n = 1; n <= TellOnce::kToldMax + 1; ++n)
    listen(listening(n, "/cmd_vel/x" + std::to_string(n)));
  s.did();
  for (std::uint32_t n = 2; n <= TellOnce::kToldMax + 2; ++n)
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

// Subscriptions are of what all peers together may make a side hold, however many links tell them.
TEST(FarListenersShare, AnIdentityInManyLinksGetsNoMoreThanItsShare) {
  auto options = server();
  options.account.mirrors_at_once = 1000;
  options.account.memory_bytes_max = 30 * kListenerBytes;
  Script s(std::move(options));
  s.join(1);
  s.join(2);
  for (std::uint32_t link = 1; link <= 2; ++link) {
    Listeners many;
    for (std::uint32_t i = 1; i <= 40; ++i)
      many.added.push_back(listener(i, "/t" + std::to_string(link) + "_" + std::to_string(i)));
    s.say(link, many);
  }
  s.pass(1000);
  const std::string did = s.did();
  const auto made = std::count(did.begin(), did.end(), '\n');
  EXPECT_GE(made, 10) << did;
  EXPECT_LE(made, 20) << did;
  s.lose(1);
  s.lose(2);
  EXPECT_EQ(s.status().shared_bytes, 0U);
}

// Early samples are of what all peers together may make a side hold.
TEST(FarListenersShare, WithoutRoomNothingIsKept) {
  auto options = server();
  options.account.memory_bytes_max = kListenerBytes + 3000;
  Script s(std::move(options));
  s.join(1);
  s.say(1, listening(1, "/cmd_vel"));
  s.graph({topic("/cmd_vel").pub(7)});
  s.take(2, 7, std::string(1000, 'x'));
  EXPECT_EQ(s.status().shared_bytes, kListenerBytes + 1004U);
  s.take(2, 7, std::string(1500, 'y'));
  EXPECT_EQ(s.dropped(DropReason::kMemory), 1U);
  s.demand(1, 1);
  s.said(1);
  s.acknowledge(1);
  EXPECT_EQ(s.status().shared_bytes, kListenerBytes);
}

TEST(FarListenersAsNodes, EachIsSubscribedUnderItsNodesName) {
  auto options = server({rule({"/cmd_vel"}, {})});
  options.proxy_nodes = true;
  Script s(std::move(options));
  s.join(1);
  s.say(1, listening(1, "/cmd_vel"));
  EXPECT_EQ(s.did(),
            "subscribe 2 /cmd_vel reliable volatile 100\n"
            "subscribe 3 /cmd_vel reliable volatile 1 as /base\n");
  ListenerTold arm = listener(2, "/cmd_vel", "/arm");
  arm.qos = best_effort();
  s.say(1, Listeners{{arm, listener(3, "/cmd_vel", "")}, {}});
  EXPECT_EQ(s.did(), "subscribe 4 /cmd_vel best_effort volatile 1 as /arm\n");
  s.say(1, Listeners{{}, {{1}}});
  EXPECT_EQ(s.did(), "unsubscribe 3\n");
  s.lose(1);
  EXPECT_EQ(s.did(), "unsubscribe 4\nunsubscribe 2\n");
}

}  // namespace
}  // namespace connect_bridge::side_test
