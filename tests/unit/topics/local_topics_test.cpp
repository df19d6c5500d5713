// A side's own topics: offered by right, subscribed by demand, adapted to their publishers.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>

#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

TEST(SideExports, OnlyWhatARuleAllowsIsOffered) {
  Script s(server({rule({"/a", "/x/*"}, {})}));
  s.graph({topic("/a").pub(1), topic("/b").pub(2), topic("/x/y").pub(3), topic("/c").sub(4)});
  s.login(1);
  EXPECT_EQ(s.said(1), "accepts 0 rules\n");  // nothing is offered before the peer's accepts
  s.say(1, Accepts{{{{"/**"}, {}}}, {}});
  EXPECT_EQ(s.said(1), "offer 1/a[1] 2/x/y[1] complete\n");
}

TEST(SideExports, DemandForWhatIsNotThereIsIgnored) {
  Script s(server());
  s.join(1);
  s.demand(1, 77);
  EXPECT_EQ(s.did(), "");
}

TEST(SideExports, WithoutDemandNoHistoryIsKept) {
  Script s(server());
  s.graph({topic("/map").pub(1, latched())});
  s.join(1);
  s.demand(1, 1);
  s.take(2, 1, "a");
  EXPECT_GT(s.status().memory_bytes, 0U);
  s.demand(1, 1, false);
  EXPECT_EQ(s.status().memory_bytes, 0U);
}

TEST(SideExports, AVolatileTopicHasNoHistory) {
  Script s(server());
  s.graph({topic("/a").pub(1)});
  s.join(1);
  s.demand(1, 1);
  s.take(2, 1, "a");
  s.join(2);
  s.demand(2, 1);
  EXPECT_EQ(s.said(2), "");
}

TEST(SideExports, DepthAloneIsNoReasonForANewVolatileSubscription) {
  Script s(server());
  s.graph({topic("/a").pub(1, qos(10))});
  s.join(1);
  s.demand(1, 1);
  s.did();
  s.graph({topic("/a").pub(1, qos(10)).pub(2, qos(5000))});
  EXPECT_EQ(s.did(), "");
}

TEST(SideExports, ALatchedSubscriptionGrowsWithItsPublishersAndRepeatsNothing) {
  Script s(server());
  s.graph({topic("/map").pub(1, latched(80))});
  s.join(1);
  s.demand(1, 1);
  EXPECT_EQ(s.did(), "subscribe 2 /map reliable latched 128\n");
  s.take(2, 1, "a", 1);
  EXPECT_EQ(s.said(1), "1.1 a\n");
  s.graph({topic("/map").pub(1, latched(80)).pub(2, latched(1))});
  EXPECT_EQ(s.did(), "unsubscribe 2\nsubscribe 3 /map reliable latched 256\n");
  s.take(2, 1, "late", 2);  // of the subscription that is gone
  s.take(3, 1, "a", 1);     // the middleware gives the history again
  s.take(3, 1, "b", 3);
  EXPECT_EQ(s.said(1), "origins 1 +[2] -[]\n1.1 b\n");
}

TEST(SideExports, AnOverrideCanAskForLessOnly) {
  auto treated = everything();
  treated.treatment.qos.reliability = Reliability::kBestEffort;
  treated.treatment.qos.durability = Durability::kTransientLocal;  // which the publisher has not
  treated.treatment.qos.depth = 300;
  Script s(server({treated}));
  s.graph({topic("/a").pub(1)});
  s.join(1);
  s.demand(1, 1);
  EXPECT_EQ(s.did(), "subscribe 2 /a best_effort volatile 300\n");
}

TEST(SideExports, AFailedSubscriptionIsTriedAgainWhenPublishersChange) {
  Script s(server());
  s.graph({topic("/a").pub(1)});
  s.join(1);
  s.demand(1, 1);
  s.did();
  s.give(SubscriptionFailed{{2}, "type_unknown", "no such type"});
  EXPECT_EQ(s.said(1), "withdraw 1 type_unknown\n");
  s.demand(1, 1);  // it crossed the withdraw
  s.graph({topic("/a").pub(1)});
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.said(1), "");
  EXPECT_NE(s.logged.find("cannot export /a: no such type\n"), std::string::npos);
  s.graph({topic("/a").pub(1).pub(2)});
  EXPECT_EQ(s.said(1), "offer 2/a[1 2]\n");
  s.demand(1, 2);
  EXPECT_EQ(s.did(), "subscribe 3 /a reliable volatile 100\n");
}

TEST(SideExports, AFailedSubscriptionIsTriedAgainForALinkThatComesLater) {
  Script s(server());
  s.graph({topic("/a").pub(1)});
  s.join(1);
  s.demand(1, 1);
  s.give(SubscriptionFailed{{2}, "type_unknown", "no such type"});
  s.said(1);
  s.did();
  s.join(2);
  s.demand(2, 1);
  EXPECT_EQ(s.did(), "subscribe 3 /a reliable volatile 100\n");
  EXPECT_EQ(s.said(1), "offer 2/a[1]\n");  // it may get it now as well
  s.give(SubscriptionFailed{{3}, "type_unknown", "no such type"});
  EXPECT_EQ(s.said(2), "withdraw 1 type_unknown\n");
  EXPECT_EQ(s.said(1), "withdraw 2 type_unknown\n");
  s.demand(1, 2);  // it crossed the withdraw
  EXPECT_EQ(s.did(), "");
}

// The peer forgets the base of an origin that has left, also for a message that it has half of.
TEST(SideExports, AnOriginDoesNotLeaveWhileAMessageOfItIsPartlySent) {
  Script s(server());
  s.graph({topic("/a").pub(1).pub(2)});
  s.join(1);
  s.demand(1, 1);
  s.take(2, 1, std::string(300'000, 'x'));
  EXPECT_EQ(s.said(1).substr(0, 5), "1.1 x");  // as much as may leave on a new connection
  EXPECT_EQ(s.status().links[0].topics[0].origins, 2U);
  s.graph({topic("/a").pub(2)});
  s.pass(10'000);
  EXPECT_EQ(s.status().links[0].topics[0].origins, 2U);
  std::string rest;
  for (int i = 0; i < 100; ++i) {
    rest += s.said(1);
    s.acknowledge(1);
    s.pass(1);
  }
  EXPECT_EQ(rest.find("origins"), std::string::npos);
  EXPECT_EQ(rest.substr(0, 3), "1+\n");
  s.pass(4000);
  EXPECT_EQ(s.said(1), "origins 1 +[] -[1]\n");
}

TEST(SideExports, NothingOfAnotherBridgeIsExported) {
  Script s(server());
  s.join(1);
  s.graph({topic(kClaimsTopic).pub(9, {}, "bridge"), topic("/a").pub(1, {}, "bridge"),
           topic("/b").pub(2)});
  EXPECT_EQ(s.said(1), "");
  s.pass(150);  // no claim has named it
  EXPECT_EQ(s.said(1), "offer 1/b[1]\n");
}

TEST(SideExports, ADeclineIsForPeople) {
  Script s(server());
  s.graph({topic("/a").pub(1)});
  s.join(1);
  s.say(1, Decline{{1}, "type_unknown", "package p is not installed"});
  s.say(1, Decline{{9}, "type_unknown", "never offered"});
  EXPECT_EQ(s.said(1), "");
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.status().links[0].topics[0].declined, "package p is not installed");
  EXPECT_NE(s.logged.find("does not import /a"), std::string::npos);
}

TEST(SideExports, ManyDeclinesAreFewLines) {
  Script s(server({callable()}));
  s.graph({topic("/a").pub(1)}, {service("/s")});
  s.join(1);
  for (int i = 0; i < 100; ++i) {
    for (const std::uint32_t id : {1U, 2U})
      s.say(1, Decline{{id}, "failed", i % 2 == 0 ? "" : "because"});
    s.say(1, Attach{{2}, {static_cast<std::uint32_t>(i + 1)}});
    s.say(1, Withdraw{{{static_cast<std::uint32_t>(i + 1)}}});
  }
  EXPECT_EQ(s.did().find("close"), std::string::npos);
  EXPECT_EQ(std::count(s.logged.begin(), s.logged.end(), '\n'), 4) << s.logged;
  EXPECT_EQ(s.status().links[0].topics[0].declined, "because");
}

// /a is subscribed as anna's rule requires. Without anna another subscription serves bert, and
// anna's link is the first that is reviewed.
struct TwoPeers : Script {
  explicit TwoPeers(const QosOverride& of_anna, const Qos& published = qos())
      : Script(options(of_anna)) {
    graph({topic("/a").pub(1, published)});
    login(1, {}, Identity{"anna", {"pilots"}, 0, "anna"});
    login(2, {}, Identity{"bert", {"crew"}, 0, "bert"});
    for (const std::uint32_t connection : {1U, 2U})
      say(connection, Accepts{{{{"/**"}, {}, {"/**"}, {"/**"}, {"/**"}}}, {}});
    did();
  }
  static SideOptions options(const QosOverride& of_anna) {
    Rule for_anna = for_group("pilots");
    for_anna.treatment.qos = of_anna;
    SideOptions options = server({for_anna, for_group("crew")});
    options.resume_for = std::chrono::seconds(60);
    return options;
  }
  static Rule for_group(const std::string& group) {
    Rule rule = everything();
    rule.groups = {group};
    return rule;
  }
};

struct RightsEnd : testing::Test {
  static QosOverride best_effort_override() {
    QosOverride weak;
    weak.reliability = Reliability::kBestEffort;
    return weak;
  }
  static QosOverride volatile_override() {
    QosOverride weak;
    weak.durability = Durability::kVolatile;
    return weak;
  }
};

TEST_F(RightsEnd, NothingIsSubscribedForALinkThatIsReviewedLater) {
  TwoPeers s(best_effort_override());
  s.demand(1, 1);
  s.demand(2, 1);
  EXPECT_EQ(s.did(), "subscribe 2 /a best_effort volatile 100\n");
  s.give(PolicyChanged{Policy({rule({"/b"}, {})})});
  EXPECT_EQ(s.did(), "unsubscribe 2\n");
}

TEST_F(RightsEnd, WhoeverKeepsTheRightIsSubscribedForOnce) {
  TwoPeers s(best_effort_override());
  s.demand(1, 1);
  s.demand(2, 1);
  s.did();
  s.give(PolicyChanged{Policy({TwoPeers::for_group("crew")})});
  EXPECT_EQ(s.did(), "unsubscribe 2\nsubscribe 3 /a reliable volatile 100\n");
  s.take(3, 1, "a");
  EXPECT_NE(s.said(2).find("1.1 a\n"), std::string::npos);
}

TEST_F(RightsEnd, NothingIsSubscribedForAListenerThatIsReviewedLater) {
  TwoPeers s(best_effort_override());
  const ListenerReport told{{1}, "/cmd", kType, {}};
  s.say(1, Listeners{{told}, {}});
  s.say(2, Listeners{{told}, {}});
  EXPECT_EQ(s.did(), "subscribe 2 /cmd best_effort volatile 100\n");
  s.give(PolicyChanged{Policy({rule({"/b"}, {})})});
  EXPECT_EQ(s.did(), "unsubscribe 2\n");
}

// Anna's link is lost, and what is kept for it ends.
TEST_F(RightsEnd, NothingIsSubscribedWhenWhatIsKeptEnds) {
  for (const bool by_rules : {true, false}) {
    TwoPeers s(volatile_override(), latched());
    s.say(1, Demand{{{{1}, 1, true}}});
    s.demand(2, 1);
    EXPECT_EQ(s.did(), "subscribe 2 /a reliable volatile 100\n");
    s.lose(1);
    EXPECT_EQ(s.did(), "");
    if (by_rules) {
      s.give(PolicyChanged{Policy({rule({"/b"}, {})})});
    } else {
      s.give(IdentitiesChanged{
          {{"anna", Identity{"anna", {}, 0, "anna"}}, {"bert", Identity{"bert", {}, 0, "bert"}}}});
    }
    EXPECT_EQ(s.did(), "unsubscribe 2\n") << by_rules;
  }
}

}  // namespace
}  // namespace connect_bridge::side_test
