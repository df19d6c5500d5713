// A service of peers: which of them feeds its mirror, and when there is one.
#include "core/services/service_mirror.hpp"

#include "unit/services/fed.hpp"

namespace connect_bridge::side_test {
namespace {

using topics_test::picture;

Rule importing_actions() {
  Rule rule = callable();
  rule.opens[Direction::kImport][OpenedBy::kActions] = {Pattern::parse("/**").value()};
  return rule;
}

Token128 another_side() {
  Token128 side;
  side.bytes.fill(9);
  return side;
}

// Another bridge's claim to /s.
Claim claim_to_s() {
  Claim claim;
  claim.side = another_side();
  claim.services = {service_gid("/s")};
  return claim;
}

// ---- the link that feeds it

TEST(ServiceMirror, OfTwoLinksOneFeedsAndTheOtherStandsBy) {
  OneLink other(2);
  Fed s;
  s.offer(other, service_channel(1, "/s"));
  EXPECT_EQ(other.said(), "");
  EXPECT_EQ(s.did(), "");
  EXPECT_NE(s.logged.find("several links offer /s"), std::string::npos);
  s.withdraw(s.peer);
  EXPECT_EQ(s.did(), "unmirror_service 1\n");
  EXPECT_EQ(other.said(), "attach 1 1\n");
  EXPECT_TRUE(s.attached(other, {{1}, {1}, {}}));
  EXPECT_EQ(s.did(), "mirror_service 2 /s\n");
}

// The link's session may go on under another identity.
TEST(ServiceMirror, ResultsAreAwaitedFromTheIdentityThatGotTheCalls) {
  for (const bool same : {true, false}) {
    OneLink robot(2, std::make_shared<Account>(), std::chrono::seconds(60));
    OfferedServices s(importing_actions());
    robot.link.login.set_identity(called("robot"));
    ServiceMirror& results = s.offer(robot, offer_of_part(1, ActionPart::kGetResult));
    EXPECT_TRUE(s.attached(robot, {{1}, {1}, {}}));
    RequestTaken request{{1}, {7}, sample("a")};
    results.on_request(request, ms(0));
    s.did();
    EXPECT_TRUE(results.on_link_lost({2}));
    robot.lose();
    robot.connect();
    robot.link.login.set_identity(called(same ? "robot" : "other"));
    ChannelOffer again = offer_of_part(1, ActionPart::kGetResult);
    again.epoch = 8;
    s.offer(robot, again);
    EXPECT_EQ(s.did().find("abort_request 1.7") == std::string::npos, same);
  }
}

TEST(ServiceMirror, ARestartedClientTakesOverFromItsOldConnection) {
  OneLink successor(2);
  Fed s;
  for (OneLink* of : {&s.peer, &successor}) of->link.login.set_identity(called("ops"));
  s.offer(successor, service_channel(1, "/s"));
  EXPECT_EQ(s.did(), "unmirror_service 1\n");
  EXPECT_EQ(s.said(), "withdraw 1\n");
  EXPECT_EQ(successor.said(), "attach 1 1\n");
  EXPECT_TRUE(s.attached(successor, {{1}, {1}, {}}));
  EXPECT_EQ(s.did(), "mirror_service 2 /s\n");
}

TEST(ServiceMirror, WhatAnotherLinkOffersMayFit) {
  OneLink other(2);
  Fed s;
  s.offer(other, service_channel(1, "/s"));
  s.subject->on_mirror_failed({{1}, "type_mismatch", "other hash", "hash_here"}, ms(s.at));
  s.update();
  EXPECT_EQ(s.said(), "decline 1 type_mismatch\nwithdraw 1\n");
  EXPECT_EQ(other.said(), "attach 1 1\n");
  EXPECT_TRUE(s.attached(other, {{1}, {1}, {}, {}, "hash_here"}));
  EXPECT_NE(s.did().find("mirror_service 2 /s\n"), std::string::npos);
  // The first is not tried again.
  s.withdraw(other);
  EXPECT_EQ(s.did(), "unmirror_service 2\n");
  EXPECT_EQ(s.said(), "");
}

TEST(ServiceMirror, AFailureOfTheMiddlewareIsNoReasonToAskAnotherLink) {
  OneLink other(2);
  Fed s;
  s.offer(other, service_channel(1, "/s"));
  s.subject->on_mirror_failed({{1}, "failed", "no memory"}, ms(s.at));
  s.update();
  EXPECT_EQ(s.said(), "decline 1 failed\nwithdraw 1\n");
  EXPECT_EQ(other.said(), "");
}

TEST(ServiceMirror, AMirrorThatFailedIsTriedAgainWhenItIsOfferedAgain) {
  OneLink other(2);
  Fed s;
  s.subject->on_mirror_failed({{1}, "failed", "no memory"}, ms(s.at));
  s.update();
  EXPECT_EQ(s.said(), "decline 1 failed\nwithdraw 1\n");
  s.update();
  EXPECT_EQ(s.said(), "");
  s.offer(other, service_channel(1, "/s"));
  EXPECT_EQ(s.said(), "attach 1 2\n");
}

TEST(ServiceMirror, AnotherEpochIsAnotherServer) {
  Fed s;
  s.request(7, "a");
  s.lose();
  s.offer(8);
  EXPECT_EQ(s.did(), "unmirror_service 1\n");
  EXPECT_EQ(s.said(), "attach 1 2\n");
  EXPECT_TRUE(s.attached({}, {}, 2));
  EXPECT_EQ(s.did(), "mirror_service 2 /s\n");
  EXPECT_EQ(s.said(), "");  // the call is gone
  EXPECT_EQ(s.held(), "0 0");
}

TEST(ServiceMirror, TheMirrorOutlivesAConnectionButNotItsLink) {
  Fed s;
  s.lose();
  s.update();
  EXPECT_EQ(s.did(), "");
  LinkEnd all;
  EXPECT_TRUE(s.imports.on_link_dead({1}, all, ms(s.at)));
  EXPECT_EQ(s.did(), "unmirror_service 1\n");
  EXPECT_TRUE(s.imports.services.empty());
}

// ---- when the mirror appears

TEST(ServiceMirror, NoMirrorBeforeTheGraphIsDiscovered) {
  OfferedServices s;
  s.imports.graph_since.reset();
  const ServiceMirror& service = s.offer(s.peer, service_channel(1, "/s"));
  EXPECT_EQ(s.said(), "");
  s.imports.graph_since = ms(0).steady;
  s.update();
  EXPECT_EQ(s.said(), "attach 1 1\n");
  EXPECT_TRUE(s.attached(s.peer, {{1}, {1}, {}}));
  s.pass_to(1499);
  EXPECT_FALSE(service.is_claimed());
  EXPECT_EQ(s.did(), "");
  s.pass_to(1500);
  EXPECT_TRUE(service.is_claimed());
  EXPECT_EQ(s.did(), "mirror_service 1 /s\n");
}

TEST(ServiceMirror, BesideAnotherBridgeItIsClaimedBeforeItAppears) {
  OfferedServices s;
  s.graph = picture({topic(kClaimsTopic).pub(9, {}, "bridge")});
  const ServiceMirror& service = s.offer(s.peer, service_channel(1, "/s"));
  EXPECT_TRUE(service.is_claimed());
  EXPECT_TRUE(s.attached(s.peer, {{1}, {1}, {}}));
  s.pass_to(999);
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.imports.looks.deadline(), ms(1000).steady);
  s.pass_to(1000);
  EXPECT_EQ(s.did(), "mirror_service 1 /s\n");
  EXPECT_FALSE(s.imports.looks.deadline());
}

// It gives way when it hears ours; until then its server may take calls.
TEST(ServiceMirror, OfTwoThatClaimAtOnceTheFirstWaitsForTheOthersServer) {
  OfferedServices s;
  s.graph = picture({topic(kClaimsTopic).pub(9, {}, "bridge")});
  const ServiceMirror& service = s.offer(s.peer, service_channel(1, "/s"));
  EXPECT_TRUE(s.attached(s.peer, {{1}, {1}, {}}));
  s.claims.update(gid(9), claim_to_s(), ms(500).steady);
  s.pass_to(1000);
  EXPECT_TRUE(service.is_claimed());
  EXPECT_EQ(s.did(), "");
  Claim nothing;
  nothing.side = another_side();
  s.claims.update(gid(9), nothing, ms(1500).steady);
  s.update();
  EXPECT_EQ(s.did(), "");  // the graph may show it for a moment
  s.claims.expire(ms(2500).steady);
  s.update();
  EXPECT_EQ(s.did(), "mirror_service 1 /s\n");
}

TEST(ServiceMirror, WithoutAPlaceItClaimsNothing) {
  OfferedServices s;
  s.graph = picture({topic(kClaimsTopic).pub(9, {}, "bridge")});
  AccountOptions limits;
  limits.services_max = 4;
  Shares shares(limits);
  OneLink peer(2, std::make_shared<Account>(limits, &shares));
  const ServiceMirror& service = s.offer(peer, service_channel(1, "/s"));
  EXPECT_TRUE(s.attached(peer, {{1}, {1}, {}}));
  auto all = shares.service_places.hold(4);
  s.update();
  EXPECT_FALSE(service.is_claimed());
  EXPECT_EQ(s.did(), "");
  EXPECT_NE(s.logged.find("no place"), std::string::npos);
  all.release();
  s.pass_to(2000);
  EXPECT_TRUE(service.is_claimed());
  s.pass_to(3000);
  EXPECT_EQ(s.did(), "mirror_service 1 /s\n");
  s.imports.services.clear();
}

// All of them in one step would hold up everybody.
TEST(ServiceMirror, OfManyWithoutAPlaceFewLookAtOnce) {
  OfferedServices s;
  AccountOptions limits;
  limits.services_max = 4;
  Shares shares(limits);
  OneLink peer(2, std::make_shared<Account>(limits, &shares));
  const auto all = shares.service_places.hold(4);
  for (std::uint32_t n = 1; n <= 150; ++n) {
    s.offer(peer, service_channel(n, "/s" + std::to_string(n)));
    EXPECT_TRUE(s.attached(peer, {{n}, {1}, {}}));
  }
  s.update();
  for (int step = 0; step < 2; ++step) {
    s.pass_to(2000);
    EXPECT_EQ(s.imports.deadline(), ms(2000).steady);  // others' turns are in between
  }
  s.pass_to(2000);
  EXPECT_EQ(s.imports.deadline(), ms(4000).steady);
  s.imports.services.clear();
}

TEST(ServiceMirror, WhatThePeerDoesNotAnswerIsNotClaimedForLong) {
  OfferedServices s;
  const ServiceMirror& service = s.offer(s.peer, service_channel(1, "/s"));
  s.pass_to(9999);
  s.update();
  EXPECT_TRUE(service.is_claimed());
  s.pass_to(10'000);
  EXPECT_FALSE(service.is_claimed());
  s.update();
  EXPECT_FALSE(service.is_claimed());
  EXPECT_TRUE(s.attached(s.peer, {{1}, {1}, {}}));
  EXPECT_TRUE(service.is_claimed());
  EXPECT_EQ(s.did(), "mirror_service 1 /s\n");
}

TEST(ServiceMirror, WithoutAMirrorALostLinkClaimsNothing) {
  OfferedServices s;
  s.graph = picture({topic(kClaimsTopic).pub(9, {}, "bridge")});
  ServiceMirror& service = s.offer(s.peer, service_channel(1, "/s"));
  EXPECT_TRUE(service.is_claimed());
  EXPECT_TRUE(service.on_link_lost({1}));
  s.update();
  EXPECT_FALSE(service.is_claimed());
}

// ---- the link that its action's goals go to

TEST(ServiceMirror, ACancelGoesWhereGoalsAreTakenRatherThanOnlyOffered) {
  OneLink other(2);
  OfferedServices s(importing_actions());
  s.offer(s.peer, offer_of_part(1, ActionPart::kSendGoal, "p/action/A"));
  s.offer(other, offer_of_part(1, ActionPart::kSendGoal, "p/action/B"));
  EXPECT_TRUE(s.attached(other, {{1}, {1}, {}}));
  EXPECT_EQ(s.did(), "mirror_service 1 /go/_action/send_goal\n");
  EXPECT_EQ(s.said(), "attach 1 1\n");
  EXPECT_EQ(other.said(), "attach 1 1\n");
  for (OneLink* const peer : {&s.peer, &other})
    s.offer(*peer, offer_of_part(2, ActionPart::kCancelGoal));
  EXPECT_EQ(s.said(), "");
  EXPECT_EQ(other.said(), "attach 2 2\n");
}

// ---- why there is none

TEST(ServiceMirror, ARealServerHereMakesTheMirrorGo) {
  Fed s;
  s.request(7, "a");
  s.said();
  GraphChanged real;
  real.services = {service("/s", {0})};
  s.graph = GraphView(real);
  s.update();
  EXPECT_EQ(s.did(), "unmirror_service 1\n");
  EXPECT_EQ(s.said(), "withdraw 1\n");  // of the requests
  EXPECT_EQ(s.held(), "0 0");
  EXPECT_NE(s.logged.find("is not mirrored"), std::string::npos);
  s.graph = GraphView();
  s.update();
  EXPECT_EQ(s.said(), "attach 1 2\n");
  EXPECT_TRUE(s.attached({1}, {}, 1));  // the answer to the first one
  EXPECT_EQ(s.did(), "");
  EXPECT_TRUE(s.attached({1}, {}, 2));
  EXPECT_EQ(s.did(), "mirror_service 2 /s\n");
}

TEST(ServiceMirror, WhatAnotherBridgeClaimsIsLeftToIt) {
  OfferedServices s;
  s.claims.update(gid(9), claim_to_s(), ms(0).steady);
  const ServiceMirror& service = s.offer(s.peer, service_channel(1, "/s"));
  EXPECT_FALSE(service.is_claimed());
  EXPECT_EQ(s.said(), "");
}

// It may have a server of that name, but the graph tells neither of which node nor of which
// process.
TEST(ServiceMirror, AServerThatABridgeLeavesBehindIsWaitedFor) {
  OfferedServices s;
  s.claims.update({}, claim_to_s(), ms(0).steady);
  GraphChanged shown;
  shown.services = {service("/s", {0})};
  s.graph = GraphView(shown);
  s.offer(s.peer, service_channel(1, "/s"));
  Claim last;
  last.side = another_side();
  last.good_for = Duration::zero();
  s.claims.update({}, last, ms(0).steady);
  s.update();
  EXPECT_EQ(s.said(), "");
  EXPECT_EQ(s.logged, "");
  s.graph = GraphView();
  s.update();
  EXPECT_EQ(s.said(), "attach 1 1\n");
}

// Of two that claim at once the other one gives way.
TEST(ServiceMirror, WhatTheOtherOneStillShowsDoesNotEndOurs) {
  Fed s;
  s.claims.update({}, claim_to_s(), ms(0).steady);
  GraphChanged shown;
  shown.services = {service("/s", {0})};
  s.graph = GraphView(shown);
  s.update();
  EXPECT_EQ(s.did(), "");
}

// Its id is the larger one.
TEST(ServiceMirror, AMirrorDoesNotGiveWayToABridgeThatComesLater) {
  Fed s;
  s.claims.update(gid(9), claim_to_s(), ms(0).steady);
  s.update();
  EXPECT_EQ(s.did(), "");
}

TEST(ServiceMirror, APeerInOurOwnGraphHasNoMirror) {
  Fed s;
  Claim its_own;
  its_own.side = s.peer.link.connection()->peer().side;
  s.claims.update(gid(9), its_own, ms(0).steady);
  s.update();
  EXPECT_EQ(s.did(), "unmirror_service 1\n");
  EXPECT_EQ(s.said(), "withdraw 1\n");
}

TEST(ServiceMirror, TheParametersOfOurOwnNodeHaveNone) {
  Rule rule;
  rule.opens[Direction::kImport][OpenedBy::kParameters] = {Pattern::parse("/**").value()};
  OfferedServices s(rule);
  std::uint32_t channel = 0;
  for (const char* name : {"/connect/get_parameters", "/other/get_parameters"}) {
    ChannelOffer offer = service_channel(++channel, name);
    offer.type = "rcl_interfaces/srv/GetParameters";
    s.offer(s.peer, offer);
  }
  EXPECT_EQ(s.said(), "attach 2 1\n");
}

// A bridge beside this one may claim and end without end, whatever our peers offer.
TEST(ServiceMirror, AClaimConcernsTheServicesThatItNames) {
  constexpr std::uint32_t kOffered = 200;
  Fed s;
  for (std::uint32_t n = 2; n <= kOffered; ++n)
    s.offer(s.peer, service_channel(n, "/s" + std::to_string(n)));
  auto updates = [&, before = std::uint64_t{}]() mutable {
    return s.imports.updated() - std::exchange(before, s.imports.updated());
  };
  updates();
  Claim claim = claim_to_s();
  claim.services.clear();
  s.claims.update({}, claim, ms(0).steady);  // the first bridge: each service waits longer
  s.imports.on_claims(ms(0));
  EXPECT_EQ(updates(), kOffered);
  s.claims.update({}, claim_to_s(), ms(1).steady);
  s.imports.on_claims(ms(1));
  EXPECT_EQ(updates(), 1U);
  s.imports.on_claims(ms(2));
  EXPECT_EQ(updates(), 0U);
  claim.services = {service_gid("/s7"), service_gid("/s9")};
  s.claims.update({}, claim, ms(3).steady);
  s.imports.on_claims(ms(3));
  EXPECT_EQ(updates(), 3U);
}

}  // namespace
}  // namespace connect_bridge::side_test
