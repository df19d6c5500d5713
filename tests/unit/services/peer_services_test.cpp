// A peer's services: mirrored while they can be called, each call answered to its caller or ended.
#include <gtest/gtest.h>

#include <string>

#include "unit/services/calls_script.hpp"

namespace connect_bridge::side_test {
namespace {

const std::string kClaim = "claim [" + std::to_string(service_gid("/s").bytes[0]) + "]\n";

TEST(PeerServices, TheMirrorExistsWhenTheServiceCanBeCalled) {
  Script s(server({callable()}));
  s.graph({});
  s.join(1);
  s.pass(kDiscovered);
  s.say(1, Offer{{service_channel(1, "/s")}, true});
  EXPECT_EQ(s.said(1), "attach 1 1\n");
  EXPECT_EQ(s.did(), kClaim);
  s.say(1, Attached{{1}, {1}, {0}, {}, "hash"});
  EXPECT_EQ(s.did(), "mirror_service 1 /s\n");
  s.say(1, Withdraw{{{1}}});
  EXPECT_EQ(s.did(), "unmirror_service 1\nclaim []\n");
  EXPECT_EQ(s.said(1), "withdraw 1\n");  // of the requests
}

TEST(PeerServices, OnlyWhatARuleAllowsIsImported) {
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

TEST(PeerServices, WhatIsNotOfferedAgainEnds) {
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

TEST(PeerServices, WhatIsNoLongerAllowedEnds) {
  Script s(server({callable()}));
  mirrored(s);
  request(s, 11, "q");
  s.said(1);
  s.give(PolicyChanged{Policy({rule({}, {})})});
  EXPECT_EQ(s.did(), "unmirror_service 1\nclaim []\n");
  EXPECT_EQ(s.said(1), "accepts 0 rules\nwithdraw 1\ndecline 1 not_permitted\n");
}

TEST(PeerServices, MirrorsBelongToANodeOfTheirOwnIfAsked) {
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

// Whoever has the peer's definition does not notice.
TEST(PeerServices, WhetherAnotherDefinitionIsAllowedConcernsOnlyThoseThatHaveOne) {
  Script s(server({callable()}));
  mirrored(s);
  for (const bool allowed : {true, false}) {
    Rule rule = callable();
    rule.treatment.allow_type_mismatch = allowed;
    s.give(PolicyChanged{Policy{{rule}}});
    EXPECT_EQ(s.did(), "");
    EXPECT_EQ(s.said(1), "accepts 1 rules\n");
  }
  request(s, 1, "a");
  s.pass(1);
  EXPECT_EQ(s.said(1), "1.1 a\n");
}

TEST(PeerServices, AnotherDefinitionIsAllowedOrNotFromNowOn) {
  Rule brave = callable();
  brave.treatment.allow_type_mismatch = true;
  Script s(server({brave}));
  mirrored(s);
  s.give(ServiceTypeDiffers{{1}, "hash_here"});
  s.did();
  s.give(PolicyChanged{Policy{{callable()}}});
  EXPECT_EQ(s.did().substr(0, 19), "unmirror_service 1\n");
  EXPECT_EQ(s.said(1), "accepts 1 rules\nwithdraw 1\nattach 1 2\n");
}

// The rules have changed while the mirror was made.
TEST(PeerServices, AnotherDefinitionIsNotUsedWhenItIsAllowedNoLonger) {
  Rule brave = callable();
  brave.treatment.allow_type_mismatch = true;
  Script s(server({brave}));
  mirrored(s);
  s.give(PolicyChanged{Policy{{callable()}}});
  EXPECT_EQ(s.did(), "");
  s.give(ServiceTypeDiffers{{1}, "hash_here"});
  EXPECT_NE(s.did().find("unmirror_service 1\n"), std::string::npos);
}

// The peer has not withdrawn what was declined.
TEST(PeerServices, WhatFailedIsMadeWhenTheRuleAllowsIt) {
  Script s(server({callable()}));
  mirrored(s);
  s.give(ServiceMirrorFailed{{1}, "type_mismatch", "other hash"});
  s.said(1);
  Rule brave = callable();
  brave.treatment.allow_type_mismatch = true;
  s.give(PolicyChanged{Policy{{brave}}});
  EXPECT_EQ(s.said(1), "accepts 1 rules\nattach 1 2\n");
}

}  // namespace
}  // namespace connect_bridge::side_test
