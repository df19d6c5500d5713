// A side's own services: offered by right, called for peers, each call once and within its bounds.
#include <gtest/gtest.h>

#include "unit/services/calls_script.hpp"

namespace connect_bridge::side_test {
namespace {

TEST(LocalServices, OnlyWhatARuleAllowsAndThePeerAcceptsIsOffered) {
  auto some = rule({}, {});
  some.opens[Direction::kExport][OpenedBy::kServices] = {Pattern::parse("/a").value(),
                                                         Pattern::parse("/b").value()};
  Script s(server({some}));
  s.graph({topic("/t").pub(9)}, {service("/a"), service("/b"), service("/c")});
  s.login(1);
  EXPECT_EQ(s.said(1), "accepts 0 rules\n");
  s.say(1, Accepts{{{{}, {}, {"/**"}}}, {"/b"}});
  EXPECT_EQ(s.said(1), "offer 1/a[] complete\n");
}

TEST(LocalServices, TopicsAndServicesAreOfferedInOneRound) {
  Script s(server({callable()}));
  s.graph({topic("/t").pub(9)}, {service("/s")});
  s.login(1);
  s.say(1, Accepts{{{{"/**"}, {}, {"/**"}}}, {}});
  EXPECT_EQ(s.said(1), "accepts 1 rules\noffer 1/t[1] 2/s[] complete\n");
}

TEST(LocalServices, WithItsServerAServiceIsWithdrawnAndItsCallsEnd) {
  Script s(server({callable()}));
  attached(s);
  s.message(1, 1, 1, "q");
  s.did();
  s.graph({}, {});
  EXPECT_EQ(s.did(), "drop_invocation 1.1\nuncall_service 1\n");
  EXPECT_EQ(s.said(1), "withdraw 1\n");
  s.message(1, 1, 2, "crossed");  // accepted until the peer ends its channel
  s.say(1, Forget{{1}, {{1}}});
  s.say(1, Withdraw{{{1}}});
  EXPECT_EQ(s.did(), "");
  s.message(1, 1, 3, "after the end");
  EXPECT_EQ(s.did(), "close 1 4010\n");
}

TEST(LocalServices, AnotherProcessAtTheOtherEndHasAskedNothing) {
  Script s(server({callable()}));
  s.graph({}, {service("/s")});
  const Token128 session = s.join(1);
  s.say(1, Attach{{1}, {1}});
  s.give(ServiceReady{{1}, true, ""});
  s.message(1, 1, 1, "q");
  s.lose(1);
  s.did();
  s.give(ConnectionOpened{{2}, "10.0.0.2"});
  s.binary(2, encode(Hello{1, 1, Script::peer_id(9), session, "/peer"}));
  s.binary(2, encode(Login{"none", {}}));
  s.give(Authenticated{{2}, Identity{}, ""});
  const std::string did = s.did();
  EXPECT_NE(did.find("drop_invocation 1.1\nuncall_service 1\n"), std::string::npos) << did;
}

TEST(LocalServices, WhatIsNoLongerAllowedEndsAlsoWhileTheLinkIsLost) {
  Script s(server({callable()}));
  attached(s);
  s.message(1, 1, 1, "q");
  s.lose(1);
  s.did();
  s.give(PolicyChanged{Policy({rule({}, {})})});
  EXPECT_EQ(s.did(), "drop_invocation 1.1\nuncall_service 1\n");
}

TEST(LocalServices, WhatWaitsIsNotBegunWhenItsRightEnds) {
  auto capped = callable();
  capped.treatment.calls_max = 2;
  Script s(server({capped}));
  s.graph({}, {service("/a"), service("/b")});
  s.join(1);
  for (const std::uint32_t id : {1U, 2U}) {
    s.say(1, Attach{{id}, {id}});
    s.give(ServiceReady{{id}, true, ""});
  }
  for (const std::uint32_t call : {1U, 2U, 3U}) s.message(1, 1, call, "q");
  EXPECT_EQ(s.did(), "call_service 1 /a\ncall_service 2 /b\ninvoke 1.1 q\ninvoke 1.2 q\n");
  s.give(PolicyChanged{Policy({rule({}, {})})});
  EXPECT_EQ(s.did(),
            "drop_invocation 1.1\ndrop_invocation 1.2\nuncall_service 1\nuncall_service 2\n");
}

TEST(LocalServices, TheEndOfAPeersCallNumbersIsItsOwn) {
  Script s(server({callable()}));
  attached(s);
  s.join(2);
  s.say(2, Attach{{1}, {1}});
  s.message(2, 1, 1, "other");
  s.message(1, 1, 0xF0000000, "last");
  EXPECT_EQ(s.did(), "invoke 1.1 other\ninvoke 1.2 last\ndrop_invocation 1.2\n");
  EXPECT_EQ(s.said(1), "withdraw 1\noffer 2/s[]\n");
  s.said(2);
  answer(s, 1, "a");
  EXPECT_EQ(s.said(2), "1.1 a\n");
}

TEST(LocalServices, NothingOfAnotherBridgeIsExported) {
  Script s(server({callable()}));
  s.join(1);
  s.graph({topic(kClaimsTopic).pub(9, {}, "bridge")}, {});
  s.claim_service(9, 200, "/proxied");
  auto its_own = service("/its", {0});
  its_own.servers[0].node_name = "bridge";
  s.graph({topic(kClaimsTopic).pub(9, {}, "bridge")},
          {its_own, service("/real", {0}), service("/proxied", {0})});
  EXPECT_EQ(s.said(1), "offer 1/real[]\n");
  s.claim(9, 200, {});
  s.pass(1000);
  EXPECT_EQ(s.said(1), "offer 2/proxied[]\n");
}

TEST(LocalServices, AnAttachMayCrossTheWithdraw) {
  Script s(server({callable()}));
  s.graph({}, {service("/s")});
  s.join(1);
  s.graph({}, {});
  s.say(1, Attach{{1}, {5}});
  s.message(1, 5, 1, "dropped");
  s.say(1, Withdraw{{{5}}});
  EXPECT_EQ(s.did(), "");
  s.say(1, Attach{{1}, {5}});
  s.say(1, Attach{{1}, {5}});  // a number that is in use
  EXPECT_EQ(s.did(), "close 1 4009\n");
}

}  // namespace
}  // namespace connect_bridge::side_test
