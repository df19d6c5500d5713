// What a node brings is offered some in each step, and ends some in each step.
#include <gtest/gtest.h>

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "unit/side/action.hpp"
#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

using namespace std::chrono_literals;

SideOptions counted(std::size_t offers, std::size_t ends = 256) {
  SideOptions options = server({acting()});
  options.offers_at_once = offers;
  options.offer_ends_at_once = ends;
  return options;
}

const Accepts kAll{{{{"/**"}, {}, {"/**"}, {"/**"}, {"/**"}}}, {}};

struct Counted : Script {
  explicit Counted(std::size_t offers, std::size_t ends = 256) : Script(counted(offers, ends)) {
    graph({});
    pass(3000);
  }
  void step() { give(TimePassed{}); }
  // Steps until nothing of this moment is left to be done.
  std::size_t settle() {
    std::size_t steps = 0;
    const auto due = [&] {
      const auto next = side.next_deadline();
      return next && *next <= flow_test::now_ms(at).steady;
    };
    for (; due() && steps < 100; ++steps) step();
    return steps;
  }
  std::uint32_t link_of(std::uint32_t connection, const std::string& name) {
    login(connection, {}, called(name));
    say(connection, kAll);
    settle();
    said(connection);
    return connection;
  }
};

TEST(Offering, AStepOffersSoMuchAndTheNextOneGoesOn) {
  Counted s(2);
  s.join(1);
  s.graph({topic("/a").pub(1), topic("/b").pub(2), topic("/c").pub(3)}, {service("/s")});
  EXPECT_EQ(s.said(1), "offer 1/a[1] 2/b[1]\n");
  s.step();
  EXPECT_EQ(s.said(1), "offer 3/c[1] 4/s[]\n");
  EXPECT_EQ(s.settle(), 0U);
  EXPECT_EQ(s.said(1), "");
}

TEST(Offering, TheFirstRoundIsCompleteWithItsLastOffer) {
  Counted s(1);
  s.graph({topic("/a").pub(1), topic("/b").pub(2)}, {service("/s")});
  s.login(1);
  s.said(1);
  s.say(1, kAll);
  EXPECT_EQ(s.said(1), "offer 1/a[1]\n");
  s.step();
  EXPECT_EQ(s.said(1), "offer 2/b[1]\n");
  s.step();
  EXPECT_EQ(s.said(1), "offer 3/s[] complete\n");
}

// Its second half is looked at before what came meanwhile.
TEST(Offering, WhatComesDuringTheFirstRoundIsOfferedBehindIt) {
  Counted s(1);
  s.graph({topic("/b").pub(2), topic("/c").pub(3)});
  s.login(1);
  s.said(1);
  s.say(1, kAll);
  s.graph({topic("/a").pub(1), topic("/b").pub(2), topic("/c").pub(3)});
  EXPECT_EQ(s.said(1), "offer 1/b[1]\noffer 2/c[1] complete\n");
  s.settle();
  EXPECT_EQ(s.said(1), "offer 3/a[1]\n");
}

TEST(Offering, RulesThatChangeMeanwhileHoldForTheRest) {
  Counted s(1);
  s.join(1);
  s.graph({topic("/a").pub(1), topic("/b").pub(2), topic("/c").pub(3)});
  EXPECT_EQ(s.said(1), "offer 1/a[1]\n");
  s.give(PolicyChanged{Policy({rule({"/c"}, {})})});
  EXPECT_NE(s.said(1).find("withdraw 1"), std::string::npos);
  s.settle();
  EXPECT_EQ(s.said(1).find("/b"), std::string::npos);
  ASSERT_EQ(s.status().links.front().topics.size(), 1U);
  EXPECT_EQ(s.status().links.front().topics.front().topic, "/c");
}

// The peer listens, so it is not to miss the sample.
TEST(Offering, ASampleIsKeptForAListenerWhoseOfferHasNotHadItsTurn) {
  Counted s(1);
  s.join(1);
  s.say(1, Listeners{{{{1}, "/b", kType, ""}}, {}});
  s.pass(1000);
  s.graph({});
  s.did();
  s.graph({topic("/a").pub(1), topic("/b").pub(2)});
  EXPECT_EQ(s.said(1), "offer 1/a[1]\n");
  s.take(2, 2, "first");
  EXPECT_EQ(s.said(1), "offer 2/b[1]\n");
  s.settle();
  s.demand(1, 2);
  EXPECT_EQ(s.said(1), "2.1 first\n");
}

// Each message about one counts as an offer.
TEST(Offering, OriginsThatComeToWhatIsOfferedAreCountedToo) {
  Counted s(1);
  s.graph({topic("/a").pub(1), topic("/b").pub(2)});
  for (std::uint32_t link = 1; link <= 3; ++link) s.link_of(link, "many");
  s.graph({topic("/a").pub(1).pub(3), topic("/b").pub(2).pub(4)});
  const std::string first = "origins 1 +[2] -[]\n", second = "origins 2 +[2] -[]\n";
  EXPECT_EQ(s.said(1), first);
  EXPECT_EQ(s.said(2) + s.said(3), "");
  EXPECT_EQ(s.settle(), 5U);
  EXPECT_EQ(s.said(1), second);
  EXPECT_EQ(s.said(2), first + second);
  EXPECT_EQ(s.said(3), first + second);
}

// Each of many publishers of a topic counts.
TEST(Offering, AnOfferOfManyOriginsIsMoreThanOne) {
  Counted s(2);
  Topic crowded = topic("/a");
  for (std::uint8_t n = 1; n <= 64; ++n) crowded.pub(n);
  s.join(1);
  s.graph({crowded, topic("/b").pub(100)});
  EXPECT_EQ(s.said(1).find("/b"), std::string::npos);
  s.step();
  EXPECT_EQ(s.said(1), "offer 2/b[1]\n");
}

TEST(Offering, ASampleComesBehindItsOriginThatHasNotHadItsTurn) {
  Counted s(1);
  s.graph({topic("/a").pub(1), topic("/b").pub(2)});
  for (std::uint32_t link = 1; link <= 3; ++link) s.link_of(link, "many");
  s.demand(3, 2);
  s.said(3);
  s.graph({topic("/a").pub(1).pub(3), topic("/b").pub(2).pub(4)});
  s.take(2, 2, "known");
  EXPECT_EQ(s.said(3), "2.1 known\n");
  s.take(2, 4, "new");
  EXPECT_EQ(s.said(3), "origins 2 +[2] -[]\n2.2 new\n");
  s.settle();
  EXPECT_EQ(s.said(3), "origins 1 +[2] -[]\n");
}

TEST(Offering, IdentitiesTakeTurns) {
  Counted s(1);
  for (std::uint32_t link = 1; link <= 3; ++link) s.link_of(link, "many");
  s.link_of(4, "one");
  s.graph({topic("/a").pub(1)});
  EXPECT_EQ(s.said(1), "offer 1/a[1]\n");
  s.step();
  EXPECT_EQ(s.said(4), "offer 1/a[1]\n");
  EXPECT_EQ(s.said(2) + s.said(3), "");
  EXPECT_EQ(s.settle(), 2U);
  EXPECT_EQ(s.said(2) + s.said(3), "offer 1/a[1]\noffer 1/a[1]\n");
}

// The first step is the graph's.
TEST(Offering, WhoIsOfferedMuchPaysForTheStepsThatFollow) {
  Counted s(1);
  s.link_of(1, "first");
  s.link_of(2, "second");
  const auto next_is = [&](std::uint32_t link) {
    s.side.on_arrival({{3 - link}, false, {}}, flow_test::now_ms(s.at));
    s.side.on_arrival({{link}, false, {}}, flow_test::now_ms(s.at));
    const auto next = s.side.take_turn(flow_test::now_ms(s.at));
    static_cast<void>(s.side.take_turn(flow_test::now_ms(s.at)));
    return next && next->connection.value == link;
  };
  s.did();
  s.graph({topic("/a").pub(1)});
  s.side.spent(10ms, flow_test::now_ms(s.at).steady);
  s.step();
  s.side.spent(10ms, flow_test::now_ms(s.at).steady);
  EXPECT_TRUE(next_is(1));
  EXPECT_EQ(s.settle(), 0U);
}

TEST(Offering, AnActionThatIsNotWholeAnyLongerHasNoPart) {
  Counted s(1, 1);
  s.join(1);
  serve_action(s);
  s.settle();
  EXPECT_EQ(times(s.said(1), "/fib/_action/"), 5);
  // In the step that sees it no part is left.
  s.graph({typed(topic("/fib/_action/feedback").pub(1), "p/action/Fib_FeedbackMessage")}, {});
  EXPECT_EQ(times(s.said(1), "withdraw"), 5);
}

// Two actions are more than one step takes.
TEST(Offering, ActionsTakeTurns) {
  const auto services = [](const std::string& action) {
    return std::vector<ServiceState>{
        typed(service(action + "/_action/send_goal"), "p/action/Fib_SendGoal"),
        typed(service(action + "/_action/cancel_goal"), "action_msgs/srv/CancelGoal"),
        typed(service(action + "/_action/get_result"), "p/action/Fib_GetResult")};
  };
  const auto topics = [](const std::string& action) {
    return std::vector<Topic>{
        typed(topic(action + "/_action/feedback").pub(1), "p/action/Fib_FeedbackMessage"),
        typed(topic(action + "/_action/status").pub(2), "action_msgs/msg/GoalStatusArray")};
  };
  auto all = services("/a");
  for (const auto& more : services("/b")) all.push_back(more);
  auto told = topics("/a");
  for (const auto& more : topics("/b")) told.push_back(more);
  Counted s(99, 1);
  s.join(1);
  s.graph(told, all);
  s.settle();
  EXPECT_EQ(times(s.said(1), "/_action/"), 10);
  // Their topics are gone, and the services stay.
  s.graph({}, all);
  EXPECT_EQ(times(s.said(1), "withdraw"), 5);
  s.step();
  EXPECT_EQ(times(s.said(1), "withdraw"), 5);
  s.graph(told, all);
  s.settle();
  EXPECT_EQ(times(s.said(1), "/_action/"), 10);
}

TEST(Offering, TopicsThatEndTogetherEndInSeveralSteps) {
  Counted s(8, 1);
  s.join(1);
  s.graph({topic("/a").pub(1), topic("/b").pub(2)});
  s.said(1);
  s.graph({});
  s.at += 300;
  s.step();
  EXPECT_EQ(s.said(1), "withdraw 1\n");
  s.step();
  EXPECT_EQ(s.said(1), "withdraw 2\n");
  EXPECT_EQ(s.settle(), 0U);
}

TEST(Offering, SoDoServices) {
  Counted s(8, 1);
  s.join(1);
  s.join(2);
  s.graph({}, {service("/s"), service("/t")});
  s.said(1);
  s.said(2);
  s.graph({});
  EXPECT_EQ(s.said(1) + s.said(2), "withdraw 1\n");
  EXPECT_EQ(s.settle(), 3U);
  EXPECT_EQ(s.said(1) + s.said(2), "withdraw 2\nwithdraw 1\nwithdraw 2\n");
}

TEST(Offering, AServerThatIsBackMeanwhileIsOfferedOnNewChannels) {
  Counted s(8, 1);
  s.join(1);
  s.graph({}, {service("/s"), service("/t")});
  s.said(1);
  s.graph({});
  EXPECT_EQ(s.said(1), "withdraw 1\n");
  s.graph({}, {service("/s"), service("/t")});
  EXPECT_EQ(s.said(1), "withdraw 2\noffer 3/s[] 4/t[]\n");
  s.settle();
  EXPECT_EQ(s.said(1), "");
}

// Nor is one called whose end has not had its turn.
TEST(Offering, AServiceWhoseServerIsGoneIsOfferedToNobody) {
  Counted s(8, 1);
  s.join(1);
  s.join(2);
  s.graph({}, {service("/s")});
  s.said(1);
  s.graph({});
  EXPECT_EQ(s.said(1), "withdraw 1\n");
  s.login(3);
  s.said(3);
  s.say(3, kAll);
  EXPECT_EQ(s.said(3), "offer complete\n");
  s.did();
  s.say(2, Attach{{1}, {1}});
  s.settle();
  EXPECT_EQ(s.did(), "");
}

}  // namespace
}  // namespace connect_bridge::side_test
