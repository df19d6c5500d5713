// What a bridge does while another one is in its graph: links that are lost, publishers and servers
// that come and go.
#include <gtest/gtest.h>

#include "core/base/random.hpp"
#include "core/graph/claims.hpp"
#include "core/graph/graph_view.hpp"
#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

using namespace std::chrono_literals;

Token128 side_id(std::uint8_t n) {
  Token128 id;
  id.bytes.fill(n);
  return id;
}

Topic bridge() {
  return topic(kClaimsTopic).pub(9, {}, "bridge");
}

// Another bridge is here, and /a is mirrored.
struct Beside : Script {
  explicit Beside(SideOptions options = server()) : Script(std::move(options)) {
    graph({bridge(), topic("/a").sub(1)});
    session = join(1);
    pass(1000);
    offer(1);
    EXPECT_EQ(did(), "claim [11]\n");
    pass(249);
    EXPECT_EQ(did(), "");
    pass(1);
    EXPECT_EQ(did(), "mirror 2 /a reliable volatile 10\n");
    said(1);
  }
  void offer(std::uint32_t connection) {
    say(connection, Offer{{channel(1, "/a", {origin(1, 11)})}, true});
  }
  void claim_of_other(std::vector<Gid> origins) {
    give(MessageTaken{{1}, Gid{}, 0, serialize(Claim{side_id(255), std::move(origins)}, 0)});
  }

  Token128 session;
};

// Both ends have one ROS_DOMAIN_ID, and nothing crosses.
TEST(BesideBridges, APeerInOurOwnGraphIsSaid) {
  for (const bool link_first : {false, true}) {
    Script s(server());
    s.graph({bridge()});
    if (link_first) s.join(1);
    s.give(MessageTaken{{1}, Gid{}, 0, serialize(Claim{Script::peer_id(1), {}}, 0)});
    if (!link_first) s.join(1);
    s.did();
    EXPECT_NE(s.logged.find("is in this same ROS graph"), std::string::npos);
  }
}

TEST(BesideBridges, AShortLossChangesNothing) {
  Beside s;
  s.lose(1);
  s.pass(300);
  s.join(2, s.session);
  s.did();
  s.offer(2);
  EXPECT_EQ(s.said(2).substr(0, 11), "demand 1 on");
  s.claim_of_other({gid(11)});  // its side id is the larger one
  EXPECT_EQ(s.did(), "");
}

TEST(BesideBridges, AClaimEndsWithItsLink) {
  Beside s;
  s.lose(1);
  s.pass(1500);
  EXPECT_EQ(s.did(), "");
  s.pass(1500);
  EXPECT_EQ(s.did(), "unmirror 2\nclaim []\n");
  s.claim_of_other({gid(11)});
  s.join(2, s.session);
  s.did();
  s.offer(2);
  s.pass(1000);
  EXPECT_EQ(s.did(), "");  // the other one has it now
  s.claim_of_other({});
  EXPECT_EQ(s.did(), "claim [11]\n");
  s.pass(250);
  EXPECT_EQ(s.did(), "mirror 3 /a reliable volatile 10\n");
}

// Another bridge may have it.
TEST(BesideBridges, ALostLinkMakesNoMirrorAndClaimsNothing) {
  Beside s;
  s.say(1, OriginsChanged{{1}, {origin(2, 12)}, {}});
  EXPECT_EQ(s.did(), "claim [11 12]\n");
  s.lose(1);
  EXPECT_EQ(s.did(), "claim [11]\n");
  s.pass(1000);
  EXPECT_EQ(s.did(), "");
}

// Callers have the other bridge's server by then, and each call that came meanwhile came to both.
TEST(BesideBridges, WhoStoodStillForTooLongServesNothing) {
  Script s(server({callable()}));
  s.graph({bridge()});
  s.join(1);
  s.pass(1500);
  s.say(1, Offer{{service_channel(1, "/s")}, true});
  s.say(1, Attached{{1}, {1}, {}, {}, ""});
  s.pass(1000);
  EXPECT_NE(s.did().find("mirror_service 1 /s\n"), std::string::npos);
  s.claim_service(9, 0, "/other");
  s.give(TimePassed{});  // signs of life come more often now
  s.did();
  s.at += 4001;  // without a deadline that is kept
  s.give(RequestTaken{{1}, {7}, sample("a")});
  EXPECT_EQ(s.did(), "unmirror_service 1\nclaim []\n");
  s.claim_service(9, 0, "/s");
  s.pass(2500);
  EXPECT_EQ(s.did(), "");
}

TEST(BesideBridges, WhoStartedFirstHasTheSmallerId) {
  Random random(1);
  const Stamp first = 1'800'000'000 * kStampSecond;
  const Token128 id = make_side_id(random, first);
  EXPECT_LT(id, make_side_id(random, first + kStampSecond / 1000));
  EXPECT_LT(id, make_side_id(random, 2 * first));
  EXPECT_NE(id, make_side_id(random, first));
}

// A publisher that leaves before it counts: what it has published crosses all the same.
TEST(BesideBridges, AShortLivedPublisherIsHeard) {
  Script s(server());
  s.graph({bridge(), topic("/b").pub(40, {}, "talker")});
  s.join(1);
  s.pass(1000);
  EXPECT_EQ(s.said(1), "offer 1/b[1]\n");
  s.demand(1, 1);
  s.did();
  s.graph({bridge(), topic("/b").pub(40, {}, "talker").pub(41, {}, "once")});
  s.take(2, 41, "hello");
  s.graph({bridge(), topic("/b").pub(40, {}, "talker")});
  s.pass(100);
  EXPECT_EQ(s.said(1), "");
  s.pass(50);
  EXPECT_EQ(s.said(1), "origins 1 +[2] -[]\n1.2 hello\n");
  s.pass(5000);
  EXPECT_EQ(s.said(1), "origins 1 +[] -[2]\n");
}

TEST(BesideBridges, AShortLivedMirrorIsNoOrigin) {
  Script s(server());
  s.graph({bridge(), topic("/b").pub(40, {}, "talker")});
  s.join(1);
  s.pass(1000);
  s.said(1);
  s.graph({bridge(), topic("/b").pub(40, {}, "talker").pub(41, {}, "once")});
  s.graph({bridge(), topic("/b").pub(40, {}, "talker")});
  s.give(MessageTaken{{1}, Gid{}, 0, serialize(Claim{side_id(9), {}, {gid(41)}}, 0)});
  s.pass(2000);
  EXPECT_EQ(s.said(1), "");
}

// One with our node's name is not in our view of the graph.
TEST(BesideBridges, WhatABridgeThatTheGraphDoesNotShowPublishesIsNotKept) {
  Script s(server());
  s.graph({topic("/b").pub(40, {}, "talker")});
  s.join(1);
  s.demand(1, 1);
  s.give(MessageTaken{{1}, Gid{}, 0, serialize(Claim{side_id(9), {}, {gid(41)}}, 0)});
  s.did();
  s.take(2, 41, "its own");
  EXPECT_EQ(s.did(), "");
  s.take(2, 42, "of somebody");
  EXPECT_EQ(s.did(), "refresh /b\n");
}

TEST(BesideBridges, WhatTheOtherBringsIsNotMissing) {
  Script s(server());
  s.graph({bridge(), topic("/a").sub(1).pub(8, {}, "bridge")});
  s.join(1);
  s.pass(9000);
  while (const auto packet = s.side.next_packet({1}, flow_test::now_ms(s.at))) {
    if (!packet->text) continue;
    const Bytes bytes = flow_test::joined(*packet);
    const std::string text(bytes.begin(), bytes.end());
    EXPECT_EQ(text.find("\"ask\""), std::string::npos) << text;
  }
}

// The graph shows its server a moment longer than the bridge claims it.
TEST(BesideBridges, AServiceThatABridgeHasEndedIsNotTakenForANodes) {
  Script s(server({callable()}));
  s.graph({bridge()});
  s.join(1);
  s.pass(1000);
  const auto claim = [&](bool serves) {
    Claim told{side_id(9), {}};
    if (serves) told.services = {service_gid("/s")};
    s.give(MessageTaken{{1}, Gid{}, 0, serialize(told, 0)});
  };
  claim(true);
  s.graph({bridge()}, {service("/s", {0})});  // under the name of some node
  claim(false);
  s.pass(999);
  EXPECT_EQ(s.said(1), "");
}

TEST(BesideBridges, AServerThatTakesTheNameOfAnEndedOneIsSoonReal) {
  Script s(server({callable()}));
  s.graph({bridge()});
  s.join(1);
  s.pass(1000);
  s.give(MessageTaken{{1}, Gid{}, 0, serialize(Claim{side_id(9), {}, {}, {service_gid("/s")}}, 0)});
  s.graph({bridge()}, {service("/s", {0})});
  s.give(MessageTaken{{1}, Gid{}, 0, serialize(Claim{side_id(9), {}}, 0)});
  s.pass(1000);
  EXPECT_EQ(s.said(1).substr(0, 7), "offer 1");
}

// Whatever the rules say.
TEST(BesideBridges, WhatBridgesSayToEachOtherDoesNotCross) {
  Script s(server({callable()}));
  s.graph({topic("/_connect_bridge/more").pub(40, {}, "talker")},
          {service("/_connect_bridge/s", {50})});
  s.join(1);
  s.pass(1000);
  EXPECT_EQ(s.said(1), "");
  s.say(1,
        Offer{{channel(1, kClaimsTopic, {origin(1, 11)}), channel(2, "/_connect_bridge/more", {}),
               service_channel(3, "/_connect_bridge/s")},
              true});
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.said(1),
            "decline 1 not_permitted\ndecline 2 not_permitted\ndecline 3 not_permitted\n");
}

}  // namespace
}  // namespace connect_bridge::side_test
