// A peer's services: mirrored while they can be called, each call answered to its caller or ended.
#include <gtest/gtest.h>

#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

constexpr std::int64_t kDiscovered = 500;  // no mirror before

// A peer on connection 1 that offers /s on channel 1; the side is attached, and mirror 1 exists.
void mirrored(Script& s) {
  s.graph({});
  s.join(1);
  s.pass(kDiscovered);
  s.say(1, Offer{{service_channel(1, "/s")}, true});
  s.say(1, Attached{{1}, {1}, {0}, {}, "hash"});
  s.did();
  s.said(1);
}

void request(Script& s, std::uint32_t id, const std::string& text, std::uint32_t mirror = 1) {
  s.give(RequestTaken{{mirror}, {id}, sample(text)});
}

ServiceStatus first(const Script& s, std::size_t link = 0) {
  return s.status().links.at(link).services.at(0);
}

TEST(ServiceImports, TheMirrorExistsWhenTheServiceCanBeCalled) {
  Script s(server({callable()}));
  s.graph({});
  s.join(1);
  s.pass(kDiscovered);
  s.say(1, Offer{{service_channel(1, "/s")}, true});
  EXPECT_EQ(s.said(1), "attach 1 1\n");
  EXPECT_EQ(s.did(), "claim [" + std::to_string(service_gid("/s").bytes[0]) + "]\n");
  s.say(1, Attached{{1}, {1}, {0}, {}, "hash"});
  EXPECT_EQ(s.did(), "mirror_service 1 /s\n");
  s.say(1, Withdraw{{{1}}});
  EXPECT_EQ(s.did(), "unmirror_service 1\nclaim []\n");
  EXPECT_EQ(s.said(1), "withdraw 1\n");  // of the requests
}

TEST(ServiceImports, NoMirrorBeforeTheGraphIsDiscovered) {
  Script s(server({callable()}));
  s.join(1);
  s.say(1, Offer{{service_channel(1, "/s")}, true});
  EXPECT_EQ(s.said(1), "");
  s.graph({});
  EXPECT_EQ(s.said(1), "attach 1 1\n");
  s.say(1, Attached{{1}, {1}, {0}});
  s.did();
  s.pass(kDiscovered - 1);
  EXPECT_EQ(s.did(), "");
  s.pass(1);
  EXPECT_EQ(s.did(), "mirror_service 1 /s\n");
}

TEST(ServiceImports, OnlyWhatARuleAllowsIsImported) {
  Script s(server({rule({"/**"}, {"/**"})}));
  s.graph({});
  s.join(1);
  s.say(1, Offer{{service_channel(1, "/s")}, true});
  EXPECT_EQ(s.said(1), "decline 1 not_permitted\n");
  s.message(1, 1, 1, "dropped");
  s.say(1, Attached{{1}, {1}, {0}});  // of an attachment that crossed, as far as anybody knows
  s.say(1, Withdraw{{{1}}});
  EXPECT_EQ(s.did(), "");
}

TEST(ServiceImports, CallsAreAnsweredToTheirCallers) {
  Script s(server({callable()}));
  mirrored(s);
  request(s, 11, "q1");
  request(s, 12, "q2");
  EXPECT_EQ(s.said(1), "1.1 q1, 1.2 q2\n");
  s.message(1, 1, 2, "a2");
  s.message(1, 1, 1, "a1");
  EXPECT_EQ(s.did(), "respond 1.12 a2\nrespond 1.11 a1\n");
  s.message(1, 1, 1, "again");
  s.message(1, 1, 9, "never asked");
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(first(s).duplicates, 2U);
  EXPECT_EQ(first(s).pending, 0U);
  EXPECT_EQ(s.status().memory_bytes, 0U);
}

TEST(ServiceImports, ARequestIsKeptUntilThePeerHasIt) {
  Script s(server({callable()}));
  mirrored(s);
  request(s, 11, "12345678");
  s.said(1);
  EXPECT_EQ(s.status().memory_bytes, 12U);
  s.acknowledge(1);
  EXPECT_EQ(s.status().memory_bytes, 0U);
  EXPECT_EQ(first(s).pending, 1U);
}

TEST(ServiceImports, AfterAReconnectOnlyWhatThePeerHasNotSeenIsSentAgain) {
  Script s(server({callable()}));
  s.graph({});
  const Token128 session = s.join(1);
  s.pass(kDiscovered);
  s.say(1, Offer{{service_channel(1, "/s")}, true});
  s.say(1, Attached{{1}, {1}, {0}});
  for (std::uint32_t i = 1; i <= 4; ++i) request(s, 10 + i, "q" + std::to_string(i));
  s.said(1);
  s.did();
  s.lose(1);
  request(s, 15, "q5");  // the mirror lives on
  EXPECT_EQ(s.did(), "");
  s.join(2, session);
  s.say(2, Offer{{service_channel(3, "/s")}, true});
  EXPECT_EQ(s.said(2), "attach 3 2\n");
  // 1 was refused meanwhile, 2 has its answer, 3 and later never arrived; 8 is somebody else's.
  s.say(2, Attached{{3}, {2}, {2}, {{2}, {1000}}});
  EXPECT_EQ(s.did(), "drop_request 1.11\n");
  EXPECT_EQ(s.said(2), "2.3 q3, 2.4 q4, 2.5 q5\n");
  s.message(2, 3, 2, "a2");
  EXPECT_EQ(s.did(), "respond 1.12 a2\n");
}

TEST(ServiceImports, CallsThatNobodyHereKnowsAreForgottenThere) {
  Script s(server({callable()}));
  s.graph({});
  s.join(1);
  s.pass(kDiscovered);
  s.say(1, Offer{{service_channel(1, "/s")}, true});
  s.said(1);
  s.say(1, Attached{{1}, {1}, {40}, {{38}, {39}}});
  EXPECT_EQ(s.said(1), "forget 1 38 39\n");
  request(s, 1, "q");
  EXPECT_EQ(s.said(1), "1.41 q\n");
}

TEST(ServiceImports, AnotherEpochIsAnotherServer) {
  Script s(server({callable()}));
  s.graph({});
  const Token128 session = s.join(1);
  s.pass(kDiscovered);
  s.say(1, Offer{{service_channel(1, "/s", 7)}, true});
  s.say(1, Attached{{1}, {1}, {0}});
  request(s, 11, "q");
  s.did();
  s.lose(1);
  s.join(2, session);
  s.say(2, Offer{{service_channel(1, "/s", 8)}, true});
  s.said(2);
  EXPECT_EQ(s.did().substr(0, 19), "unmirror_service 1\n");
  s.say(2, Attached{{1}, {2}, {0}});
  EXPECT_EQ(s.did(), "mirror_service 2 /s\n");
  EXPECT_EQ(s.said(2), "");  // the call is gone
}

TEST(ServiceImports, ADeadLinkTakesTheMirrorWithIt) {
  Script s(server({callable()}));
  mirrored(s);
  request(s, 11, "q");
  s.lose(1);
  s.pass(2900);
  EXPECT_EQ(s.did(), "");
  s.pass(101);
  EXPECT_EQ(s.did(), "unmirror_service 1\nclaim []\n");
  EXPECT_EQ(s.status().memory_bytes, 0U);
}

TEST(ServiceImports, WhatIsNotOfferedAgainEnds) {
  Script s(server({callable()}));
  s.graph({});
  const Token128 session = s.join(1);
  s.pass(kDiscovered);
  s.say(1, Offer{{service_channel(1, "/s")}, true});
  s.say(1, Attached{{1}, {1}, {0}});
  s.did();
  s.lose(1);
  s.join(2, session);
  s.say(2, Offer{{}, true});
  EXPECT_EQ(s.did(), "unmirror_service 1\nclaim []\n");
}

TEST(ServiceImports, ACallerThatIsGoneIsForgottenThereToo) {
  Script s(server({callable()}));
  mirrored(s);
  request(s, 11, "q1");
  request(s, 12, "q2");
  request(s, 13, "q3");
  s.said(1);
  s.acknowledge(1);
  s.give(CallersGone{{1}, {{11}, {13}, {99}}});
  EXPECT_EQ(s.did(), "drop_request 1.11\ndrop_request 1.13\n");
  EXPECT_EQ(s.said(1), "forget 1 1 3\n");
  EXPECT_EQ(first(s).pending, 1U);
}

// Control messages overtake requests: a forget would come before what it means.
TEST(ServiceImports, ARequestOnItsWayIsForgottenWhenItHasArrived) {
  Script s(server({callable()}));
  mirrored(s);
  request(s, 11, "q1");
  s.said(1);
  s.give(CallersGone{{1}, {{11}}});
  EXPECT_EQ(s.did(), "drop_request 1.11\n");
  EXPECT_EQ(s.said(1), "");
  s.acknowledge(1);
  EXPECT_EQ(s.said(1), "forget 1 1\n");
  EXPECT_EQ(first(s).pending, 0U);
}

TEST(ServiceImports, ARefusedCallIsDropped) {
  Script s(server({callable()}));
  mirrored(s);
  request(s, 11, "q1");
  request(s, 12, "q2");
  s.say(1, Refuse{{1}, {{1}, {7}}, "limit", "too many"});
  EXPECT_EQ(s.did(), "drop_request 1.11\n");
  s.say(1, Refuse{{1}, {{2}}, "timeout", "no answer"});
  EXPECT_EQ(s.did(), "drop_request 1.12\n");
  EXPECT_EQ(first(s).refused, 1U);
  EXPECT_EQ(first(s).timed_out, 1U);
  EXPECT_NE(s.logged.find("too many"), std::string::npos);
}

TEST(ServiceImports, MoreCallsThanThePeerTakesAreRefusedHere) {
  auto capped = callable();
  capped.treatment.calls_max = 1;
  auto options = server({capped});
  options.calls_waiting_max = 2;
  Script s(options);
  mirrored(s);
  for (std::uint32_t i = 1; i <= 5; ++i) request(s, i, "q");
  EXPECT_EQ(s.did(), "drop_request 1.4\ndrop_request 1.5\n");
  EXPECT_EQ(first(s).refused, 2U);
  EXPECT_NE(s.logged.find("too many calls"), std::string::npos);
}

TEST(ServiceImports, BytesOfRequestsAreBounded) {
  auto options = server({callable()});
  options.call_bytes_max = 20;
  Script s(options);
  mirrored(s);
  request(s, 1, "ten bytes");
  request(s, 2, "ten bytes");
  EXPECT_EQ(s.did(), "drop_request 1.2\n");
  s.said(1);
  s.acknowledge(1);
  request(s, 3, "ten bytes");
  EXPECT_EQ(s.did(), "");
}

TEST(ServiceImports, ACallIsGivenUpALittleLaterThanThePeerDoes) {
  auto timed = callable();
  timed.treatment.call_timeout = std::chrono::seconds(2);
  Script s(server({timed}));
  mirrored(s);
  request(s, 11, "q");
  s.said(1);
  s.acknowledge(1);
  s.pass(2999);
  EXPECT_EQ(s.did(), "");
  s.pass(1);
  EXPECT_EQ(s.did(), "drop_request 1.11\n");
  EXPECT_EQ(s.said(1), "forget 1 1\n");
}

TEST(ServiceImports, ARealServerHereMakesTheMirrorGo) {
  Script s(server({callable()}));
  mirrored(s);
  request(s, 11, "q");
  s.said(1);
  s.graph({}, {service("/s", {0})});
  EXPECT_EQ(s.did(), "unmirror_service 1\nclaim []\n");
  EXPECT_EQ(s.said(1), "offer 2/s[]\nwithdraw 1\n");  // of the requests
  EXPECT_NE(s.logged.find("is not mirrored"), std::string::npos);
  s.graph({}, {});
  EXPECT_EQ(s.said(1), "withdraw 2\nattach 1 3\n");
  s.say(1, Attached{{1}, {1}, {1}});  // the answer to the first one
  s.did();
  s.say(1, Attached{{1}, {3}, {1}});
  EXPECT_EQ(s.did(), "mirror_service 2 /s\n");
}

TEST(ServiceImports, OfTwoLinksOneFeedsAndTheOtherStandsBy) {
  Script s(server({callable()}));
  mirrored(s);
  s.join(2);
  s.say(2, Offer{{service_channel(1, "/s")}, true});
  EXPECT_EQ(s.said(2), "");
  EXPECT_EQ(s.did(), "");
  EXPECT_NE(s.logged.find("several links offer"), std::string::npos);
  s.say(1, Withdraw{{{1}}});
  s.did();
  EXPECT_EQ(s.said(2), "attach 1 1\n");
  s.say(2, Attached{{1}, {1}, {0}});
  EXPECT_EQ(s.did(), "mirror_service 2 /s\n");
}

TEST(ServiceImports, OfTwoBridgesTheSmallerSideIdMirrors) {
  Script s(server({callable()}));
  s.graph({topic(kClaimsTopic).pub(9, {}, "bridge")});
  s.join(1);
  s.pass(1000);
  s.say(1, Offer{{service_channel(1, "/s")}, true});
  s.say(1, Attached{{1}, {1}, {0}});
  s.did();
  s.claim(9, 0, {service_gid("/s")});  // within the time that others have to object
  EXPECT_EQ(s.did(), "claim []\n");
  EXPECT_EQ(s.said(1), "attach 1 1\nwithdraw 1\n");
  s.claim(9, 0, {});
  s.say(1, Attached{{1}, {2}, {0}});
  s.did();
  s.pass(149);
  EXPECT_EQ(s.did(), "");
  s.pass(1);
  EXPECT_EQ(s.did(), "mirror_service 1 /s\n");
  s.claim(9, 255, {service_gid("/s")});  // a larger id: it is the one to give way
  EXPECT_EQ(s.did(), "");
}

TEST(ServiceImports, AMirrorThatFailsIsDeclined) {
  Script s(server({callable()}));
  mirrored(s);
  s.give(ServiceMirrorFailed{{1}, "type_unknown", "package p is not installed"});
  EXPECT_EQ(s.said(1), "decline 1 type_unknown\nwithdraw 1\n");
  EXPECT_EQ(s.did(), "claim []\n");
  s.graph({});
  EXPECT_EQ(s.said(1), "");
}

TEST(ServiceImports, WhatIsNoLongerAllowedEnds) {
  Script s(server({callable()}));
  mirrored(s);
  request(s, 11, "q");
  s.said(1);
  s.give(PolicyChanged{Policy({rule({}, {})})});
  EXPECT_EQ(s.did(), "unmirror_service 1\nclaim []\n");
  EXPECT_EQ(s.said(1), "accepts 0 rules\nwithdraw 1\ndecline 1 not_permitted\n");
}

TEST(ServiceImports, RequestsAreCompressedInTheirOrder) {
  auto treated = callable();
  treated.treatment.compression = {Codec::kZstd, 3};
  auto options = server({treated});
  options.compress_job_bytes = 1000;
  Script s(options);
  mirrored(s);
  request(s, 1, std::string(2000, 'x'));
  request(s, 2, std::string(500, 'y'));
  EXPECT_EQ(s.did(), "compress 1\n");
  EXPECT_EQ(s.said(1), "");
  s.give(JobDone{{1}, sample("smaller")});
  EXPECT_EQ(s.said(1), "1.1 zstd, 1.2 zstd\n");
}

TEST(ServiceImports, MirrorsBelongToANodeOfTheirOwnIfAsked) {
  auto options = server({callable()});
  options.proxy_nodes = true;
  options.names = NameMap("/robot1", {});
  Script s(options);
  s.graph({});
  s.join(1);
  s.pass(kDiscovered);
  s.say(1, Offer{{service_channel(1, "/s")}, true});
  s.say(1, Attached{{1}, {1}, {0}});
  std::string node;
  while (const auto action = s.side.next_action())
    if (const auto* create = std::get_if<CreateServiceMirror>(&*action)) node = create->node;
  EXPECT_EQ(node, "/robot1/robot/peer_node");
}

TEST(ServiceImports, APeerThatBreaksTheProtocolIsClosed) {
  const auto closes = [](auto&& act) {
    Script s(server({callable()}));
    mirrored(s);
    act(s);
    return s.did();
  };
  const auto twice = Offer{{service_channel(1, "/t")}, false};
  EXPECT_EQ(closes([&](Script& s) { s.say(1, twice); }), "close 1 4009\n");
  EXPECT_EQ(closes([](Script& s) { s.say(1, Attached{{1}, {1}, {0}}); }), "close 1 4009\n");
  EXPECT_EQ(closes([](Script& s) { s.say(1, Attached{{8}, {1}, {0}}); }), "close 1 4010\n");
  EXPECT_EQ(closes([](Script& s) { s.say(1, Refuse{{8}, {{1}}, "limit", ""}); }), "close 1 4010\n");
  EXPECT_EQ(closes([](Script& s) { s.say(1, Withdraw{{{8}}}); }), "close 1 4010\n");
  EXPECT_EQ(closes([](Script& s) { s.say(1, Offer{{service_channel(2, "/s")}, false}); }), "");
  Script s(server({callable()}));
  s.graph({});
  s.join(1);
  s.say(1, Offer{{service_channel(1, "/s")}, true});
  s.did();
  s.say(1, Attached{{1}, {1}, {0xFFFFFFFF}});
  EXPECT_EQ(s.did(), "close 1 4009\n");
}

}  // namespace
}  // namespace connect_bridge::side_test
