// What a side tells for the audit log: who was let in, what was opened, called, ended.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "unit/services/calls_script.hpp"

namespace connect_bridge::side_test {
namespace {

using testing::HasSubstr;
using testing::Not;

const Identity kAnna{"anna", {"ops"}, 0, "token:1"};

SideOptions audited(SideOptions options) {
  options.audits = true;
  return options;
}

// What was noted since the last call.
std::string noted(Script& s) {
  s.did();
  return std::exchange(s.noted, {});
}

void accept_all(Script& s) {
  s.say(1, Accepts{{{{"/**"}, {}, {"/**"}, {"/**"}, {"/**"}}}, {}});
}

TEST(SideAudit, NothingIsMadeWhereNobodyKeepsIt) {
  Script s(server());
  s.graph({topic("/a").pub(1)});
  s.join(1);
  EXPECT_EQ(noted(s), "");
}

TEST(SideAudit, ALoginItsChannelsAndItsEnd) {
  Script s(audited(server({everything(), callable()})));
  s.graph({topic("/a").pub(1)});
  s.login(1, {}, kAnna);
  EXPECT_EQ(noted(s), "login 1 anna ops\n");
  accept_all(s);
  EXPECT_EQ(noted(s), "channel_opened 1 anna export /a by rule\n");
  s.demand(1, 1);
  s.demand(1, 1, false);
  EXPECT_EQ(noted(s),
            "demanded 1 anna export /a by rule\n"
            "demand_ended 1 anna export /a by rule\n");
  s.say(1, Decline{{1}, "type_unknown", "no such type"});
  EXPECT_EQ(noted(s), "channel_refused 1 anna export /a by rule type_unknown: no such type\n");
  s.lose(1);
  EXPECT_THAT(noted(s), HasSubstr("link_lost 1 anna connection_lost: lost"));
}

TEST(SideAudit, ARefusedStrangerAndWhatNobodyLetsHim) {
  Script s(audited(server({everything(), callable()})));
  s.give(ConnectionOpened{{1}, "10.0.0.9:1234"});
  s.binary(1, encode(Hello{1, 1, Script::peer_id(9), {}, "/peer"}));
  s.binary(1, encode(Login{"token", {}}));
  s.give(Authenticated{{1}, std::nullopt, "unknown token"});
  EXPECT_EQ(noted(s), "refused 0 login_refused: login refused: unknown token\n");
}

TEST(SideAudit, WhatAPeerOffers) {
  Script s(audited(server({rule({}, {"/a"})})));
  s.graph({});
  s.login(1, {}, kAnna);
  noted(s);
  s.say(1, Offer{{channel(1, "/a", {}), channel(2, "/b", {})}, true});
  EXPECT_EQ(noted(s),
            "channel_opened 1 anna import /a by rule\n"
            "channel_refused 1 anna import /b not_permitted: no rule allows importing /b\n");
  s.give(PolicyChanged{Policy(std::vector<Rule>{})});
  EXPECT_EQ(noted(s),
            "channel_ended 1 anna import /a by rule not_permitted: no rule allows importing it any "
            "longer\n");
}

TEST(SideAudit, CallsAndGoals) {
  Script s(audited(server({everything(), callable()})));
  s.graph({}, {service("/s")});
  s.login(1, {}, kAnna);
  accept_all(s);
  s.say(1, Attach{{1}, {1}});
  s.give(ServiceReady{{1}, true, "hash"});
  noted(s);
  s.message(1, 1, 1, "q");
  s.message(1, 1, 1, "q");  // came before
  EXPECT_EQ(noted(s), "call 1 anna export /s by rule\n");
}

TEST(SideAudit, ALostRightIsToldToThePeer) {
  Script s(audited(server({everything(), callable()})));
  s.graph({topic("/a").pub(1)}, {service("/s")});
  s.login(1, {}, kAnna);
  accept_all(s);
  noted(s);
  s.said(1);
  s.give(PolicyChanged{Policy(std::vector<Rule>{})});
  EXPECT_EQ(noted(s),
            "channel_ended 1 anna export /s by rule not_permitted: no rule allows exporting "
            "it any longer\n"
            "channel_ended 1 anna export /a by rule not_permitted: no rule allows exporting "
            "it any longer\n");
  const std::string said = s.said(1);
  EXPECT_THAT(said, HasSubstr("withdraw 1 not_permitted"));
  EXPECT_THAT(said, HasSubstr("withdraw 2 not_permitted"));
}

TEST(SideAudit, WhatThePeerAcceptsNoLongerItKnowsItself) {
  Script s(audited(server({everything(), callable()})));
  s.graph({topic("/a").pub(1)});
  s.login(1, {}, kAnna);
  accept_all(s);
  s.said(1);
  s.say(1, Accepts{});
  EXPECT_EQ(s.said(1), "withdraw 1\n");
}

TEST(SideAudit, WithdrawnAndChangedLogins) {
  Script s(audited(server({everything(), callable()})));
  s.login(1, {}, kAnna);
  noted(s);
  s.give(IdentitiesChanged{{{"token:1", Identity{"anna", {"crew"}, 0, "token:1"}}}});
  EXPECT_EQ(noted(s), "rights_changed 1 anna crew\n");
  s.give(IdentitiesChanged{{{"token:1", std::nullopt}}});
  const std::string lines = noted(s);
  EXPECT_THAT(lines, HasSubstr("revoked 1 anna"));
  EXPECT_THAT(lines, HasSubstr("link_lost 1 anna revoked: the login of anna was withdrawn"));
}

}  // namespace
}  // namespace connect_bridge::side_test
