// A real service: its servers, its client, and what links are offered of it.
#include "core/services/local_service.hpp"

#include "unit/services/served.hpp"

namespace connect_bridge::side_test {
namespace {

Rule exporting_actions() {
  Rule rule = callable();
  rule.opens[Direction::kExport][OpenedBy::kActions] = {Pattern::parse("/**").value()};
  return rule;
}

// ---- its servers

TEST(LocalService, AServerInThePlaceOfTheOldOneEndsItsAttachments) {
  Served s;
  s.attach();
  s.request(1, "a");
  s.did();
  s.servers({2});
  EXPECT_EQ(s.did(), "drop_invocation 1.1\nuncall_service 1\n");
  EXPECT_EQ(s.said(), "withdraw 1\n");
  EXPECT_TRUE(s.takes(FollowUp::kOffers));
  EXPECT_TRUE(s.offer());
}

TEST(LocalService, TheEpochStaysWithTheLinkAndEndsWithTheServer) {
  Served s;
  const std::uint32_t before = s.offered->epoch;
  EXPECT_NE(before, 0U);
  s.attach();
  s.lose();
  const auto kept = s.offer();
  ASSERT_TRUE(kept);
  EXPECT_EQ(kept->epoch, before);
  s.servers({2});
  const auto changed = s.offer();
  ASSERT_TRUE(changed);
  EXPECT_NE(changed->epoch, 0U);
  EXPECT_NE(changed->epoch, before);
}

TEST(LocalService, NoCallBeginsWhileRightsAreChecked) {
  Served s;
  s.attach();
  s.exports.hold();
  s.request(1, "a");
  EXPECT_EQ(s.did(), "");
  s.exports.go_on(ms(0));
  s.subject.begin_calls(ms(0));
  EXPECT_EQ(s.did(), "invoke 1.1 a\n");
}

// A server that is killed and started again is in the graph twice, until the first is forgotten:
// the calls at the second live on, those that only the first could have taken end.
TEST(LocalService, AServerInThePlaceOfAKilledOneKeepsItsCalls) {
  Served s;
  s.attach();
  s.request(1, "lost");
  s.at = 100;
  s.servers({1, 2}, "robot");
  s.request(2, "q");
  EXPECT_EQ(s.did(), "invoke 1.1 lost\ninvoke 1.2 q\n");
  s.servers({2}, "robot");
  EXPECT_EQ(s.did(), "drop_invocation 1.1\n");
  EXPECT_EQ(s.said(), "refuse 1 1 lost\n");
  LinkStatus status;
  s.subject.add_status(s.peer.link, status);
  EXPECT_EQ(status.services.at(0).lost, 1U);
  s.answer(2, "a");
  EXPECT_EQ(s.said(), "1.2 a\n");
}

// Without a client the graph has no ids, so a server may be replaced unseen; that is not news to
// the next one who attaches.
TEST(LocalService, AServerThatWasReplacedWithoutAClientStays) {
  Served s;
  s.attach();
  s.detach();
  s.servers({0});
  s.ask(s.peer);
  s.ready(2);
  EXPECT_EQ(s.said(), "attached 1 1 seen 0\n");
  s.servers({2});
  EXPECT_EQ(s.said(), "");
}

TEST(LocalService, SeveralServersAreToldOnce) {
  Served s;
  s.servers({1, 2});
  s.did();
  EXPECT_NE(s.logged.find("several servers"), std::string::npos);
  s.servers({1, 2, 3});
  s.did();
  EXPECT_EQ(s.logged.find("several servers"), s.logged.rfind("several servers"));
  LinkStatus status;
  s.subject.add_status(s.peer.link, status);
  EXPECT_TRUE(status.services.at(0).several_here);
}

TEST(LocalService, ServersOfOneNodeAreNotSeveral) {
  Served s;
  s.servers({1, 2}, "robot");
  s.did();
  EXPECT_EQ(s.logged, "");
  LinkStatus status;
  s.subject.add_status(s.peer.link, status);
  EXPECT_FALSE(status.services.at(0).several_here);
}

// ---- its client

TEST(LocalService, HasAClientWhileAPeerIsAttached) {
  Served s;
  EXPECT_EQ(s.did(), "");
  s.attach();
  EXPECT_TRUE(s.subject.client());
  s.detach();
  EXPECT_EQ(s.did(), "uncall_service 1\n");
  EXPECT_FALSE(s.subject.client());
}

TEST(LocalService, LinksShareAClientButNotTheirCalls) {
  OneLink other(2);
  Served s;
  s.attach();
  ASSERT_TRUE(s.subject.offer(other.link, ms(0)));
  s.ask(other);
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(other.said(), "attached 1 1 seen 0\n");
  s.request(1, "one");
  InMessage two;
  two.channel = {1};
  two.subject = CallId{1};
  two.body = sample("two");
  EXPECT_TRUE(other.link.incoming({1})->channel->on_message(std::move(two), ms(0)));
  EXPECT_EQ(s.did(), "invoke 1.1 one\ninvoke 1.2 two\n");
  s.answer(2, "for two");
  EXPECT_EQ(s.said(), "");
  EXPECT_EQ(other.said(), "1.1 for two\n");
  other.link.incoming({1})->channel->on_withdraw({}, ms(0));
  EXPECT_EQ(s.did(), "");
  s.detach();
  EXPECT_EQ(s.did(), "drop_invocation 1.1\nuncall_service 1\n");
}

TEST(LocalService, TheClientOutlivesAConnectionButNotItsLink) {
  Served s;
  s.attach();
  s.lose();
  EXPECT_EQ(s.did(), "");
  s.subject.on_link_dead({1}, ms(0));
  EXPECT_EQ(s.did(), "uncall_service 1\n");
}

TEST(LocalService, WhenTheServerCannotBeReachedItIsOfferedAgain) {
  Served s;
  s.attach();
  s.request(1, "q");
  s.did();
  s.ready(1, false);
  EXPECT_EQ(s.did(), "drop_invocation 1.1\nuncall_service 1\n");
  EXPECT_EQ(s.said(), "withdraw 1\n");
  EXPECT_TRUE(s.takes(FollowUp::kOffers));
  EXPECT_TRUE(s.offer());
}

TEST(LocalService, WhatCannotBeSentAfterItsCallWasGivenUpMakesWay) {
  Rule rule = callable();
  rule.treatment.server_queue = 1;
  Served s(rule);
  s.attach();
  s.request(1, "a");
  s.request(2, "b");
  s.forget(1);
  EXPECT_EQ(s.did(), "invoke 1.1 a\ndrop_invocation 1.1\n");  // it lies in the queue still
  s.fail(1);
  EXPECT_EQ(s.did(), "invoke 1.2 b\n");
}

TEST(LocalService, AnActionIsInUseWhileAPeerIsAttachedToItsGoals) {
  Served s(exporting_actions(), {"/go/_action/send_goal", "p/action/Go_SendGoal"});
  EXPECT_TRUE(s.exports.action_uses.empty());
  s.attach();
  ASSERT_EQ(s.exports.action_uses.size(), 1U);
  EXPECT_EQ(s.exports.action_uses[0].action, "/go");
  EXPECT_TRUE(s.exports.action_uses[0].on);
  s.detach();
  ASSERT_EQ(s.exports.action_uses.size(), 2U);
  EXPECT_FALSE(s.exports.action_uses[1].on);
}

// ---- a client that cannot be made

TEST(LocalService, WithoutAClientItIsWithdrawnUntilItsServersChange) {
  Served s;
  s.ask(s.peer);
  s.did();
  s.fail_client(1);
  EXPECT_EQ(s.said(), "withdraw 1 type_unknown\n");
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.logged, "cannot export /s: no such type\n");
  s.servers({1});
  EXPECT_FALSE(s.offer());
  s.subject.review(s.peer.link, ms(0));
  EXPECT_FALSE(s.offer());
  EXPECT_FALSE(s.takes(FollowUp::kOffers));
  s.servers({1, 2}, "robot");
  EXPECT_TRUE(s.takes(FollowUp::kOffers));
  EXPECT_TRUE(s.offer());
}

TEST(LocalService, AClientIsTriedAgainForALinkThatComesLater) {
  OneLink later(2);
  Served s;
  s.ask(s.peer);
  s.fail_client(1);
  s.did();
  s.said();
  ASSERT_TRUE(s.subject.offer(later.link, ms(0)));
  s.ask(later);
  EXPECT_EQ(s.did(), "call_service 2 /s\n");
  s.fail_client(2);
  EXPECT_EQ(later.said(), "withdraw 1 type_unknown\n");
  EXPECT_EQ(s.said(), "");
}

TEST(LocalService, AClientThatCanBeMadeAfterAllIsForAllLinks) {
  OneLink later(2);
  Served s;
  s.ask(s.peer);
  s.fail_client(1);
  ASSERT_TRUE(s.subject.offer(later.link, ms(0)));
  s.ask(later);
  EXPECT_FALSE(s.takes(FollowUp::kOffers));
  s.ready(2);
  EXPECT_TRUE(s.takes(FollowUp::kOffers));
  EXPECT_TRUE(s.offer());
}

// ---- what is offered

TEST(LocalService, AServiceWhoseTypeIsNotHereIsNotOffered) {
  OneLink later(2);
  Served s;
  ServiceState lacking = service("/s");
  lacking.lack = TypeLack{"type_unknown", "no such type"};
  const auto see = [&](const ServiceState& state) {
    s.show(state);
    s.subject.update_servers(state, ms(0));
  };
  see(lacking);
  EXPECT_FALSE(s.subject.offer(later.link, ms(0)));
  see(service("/s"));
  EXPECT_TRUE(s.subject.offer(later.link, ms(0)));
}

TEST(LocalService, APartOfAnActionEndsWithTheWholeAction) {
  Served s(exporting_actions(), {"/go/_action/send_goal", "p/action/Go_SendGoal"});
  EXPECT_EQ(s.offered->action_type, "p/action/Go");
  s.graph = GraphView();
  s.actions.update(s.graph, s.claims);
  s.subject.review(s.peer.link, ms(0));
  EXPECT_EQ(s.said(), "withdraw 1\n");
  EXPECT_FALSE(s.offer());
}

TEST(LocalService, WhatThePeerDoesNotAcceptAnyLongerEnds) {
  Served s;
  s.attach();
  s.peer.link.accepts.adopt(Accepts{});
  s.subject.review(s.peer.link, ms(0));
  EXPECT_EQ(s.said(), "withdraw 1\n");
  EXPECT_EQ(s.did(), "uncall_service 1\n");
  EXPECT_FALSE(s.offer());
}

TEST(LocalService, WhatOurRulesDoNotAllowAnyLongerEndsForThatReason) {
  Served s;
  s.attach();
  s.policy = Policy();
  s.subject.review(s.peer.link, ms(0));
  EXPECT_EQ(s.said(), "withdraw 1 not_permitted\n");
  EXPECT_EQ(s.did(), "uncall_service 1\n");
}

}  // namespace
}  // namespace connect_bridge::side_test
