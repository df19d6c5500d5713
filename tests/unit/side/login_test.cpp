// What becomes of a login while its link lives: it expires, is renewed, changed, withdrawn.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

using testing::HasSubstr;

const std::string kCredential = "token:1";

Identity anna(Stamp expires = 0, std::vector<std::string> groups = {}) {
  return {"anna", std::move(groups), expires, kCredential};
}

// A server whose rules let the group ops have everything.
SideOptions for_ops() {
  Rule rule = everything();
  rule.groups = {"ops"};
  return server({rule});
}

IdentitiesChanged changed(std::optional<Identity> identity,
                          const std::string& credential = kCredential) {
  return {{{credential, std::move(identity)}}};
}

Authenticated answer(std::optional<Identity> identity) {
  return {{1}, std::move(identity), "unknown token"};
}

TEST(SideLogin, EndsWhenItExpires) {
  Script s(server());
  s.login(1, {}, anna(flow_test::at_ms(700)));
  s.did();
  s.pass_to(699);
  EXPECT_EQ(s.did(), "");
  s.pass_to(700);
  EXPECT_EQ(s.did(), "close 1 4013\n");
  EXPECT_THAT(s.logged, HasSubstr("the login of anna has expired (expired)"));
}

TEST(SideLogin, EndsWithTheCertificateWhateverTheLoginMethodSays) {
  for (const Stamp login : {Stamp{0}, flow_test::at_ms(1000)}) {
    Script s(server());
    s.certified_until = flow_test::at_ms(700);
    s.login(1, {}, anna(login));
    s.said(1);
    s.did();
    s.say(1, Renew{"token", "another-token-of-anna"});
    s.give(answer(anna(flow_test::at_ms(2000))));
    s.did();
    s.pass_to(699);
    EXPECT_EQ(s.did(), "");
    s.pass_to(700);
    EXPECT_EQ(s.did(), "close 1 4013\n");
    EXPECT_THAT(s.logged, HasSubstr("the certificate of /peer at 10.0.0.1 has expired (expired)"));
  }
}

TEST(SideLogin, GoesOnWhenItIsRenewedBeforeItExpires) {
  Script s(server());
  s.login(1, {}, anna(flow_test::at_ms(700)));
  s.said(1);
  s.did();
  s.pass_to(500);
  s.say(1, Renew{"token", "another-token-of-anna"});
  EXPECT_EQ(s.did(), "authenticate 1 token renewal turn anna\n");
  s.give(answer(anna(flow_test::at_ms(2000))));
  EXPECT_EQ(s.said(1), "renewed accepted\n");
  s.pass_to(1999);
  EXPECT_EQ(s.did(), "");
  s.pass_to(2000);
  EXPECT_EQ(s.did(), "close 1 4013\n");
}

TEST(SideLogin, StaysWhatItWasWhenARenewalIsRefused) {
  for (const auto& who : {std::optional<Identity>{}, std::optional<Identity>{{"bert", {}, 0}},
                          std::optional<Identity>{anna(flow_test::at_ms(100))}}) {
    Script s(server());
    s.login(1, {}, anna(flow_test::at_ms(700)));
    s.said(1);
    s.pass_to(500);
    s.say(1, Renew{"token", "wrong"});
    s.did();
    s.give(answer(who));
    EXPECT_EQ(s.said(1), "renewed refused\n");
    EXPECT_EQ(s.status().links.at(0).identity, "anna");
    s.pass_to(699);
    EXPECT_EQ(s.did(), "");
    s.pass_to(700);
    EXPECT_EQ(s.did(), "close 1 4013\n");
  }
}

TEST(SideLogin, AnswersAreForClients) {
  Script s(server());
  s.login(1, {}, anna());
  s.say(1, Renew{"token", "a"});
  s.say(1, Renewed{false});
  s.did();
  EXPECT_THAT(s.logged, testing::Not(HasSubstr("refuses")));
  s.said(1);
  s.give(answer(anna()));
  EXPECT_THAT(s.said(1), HasSubstr("renewed accepted\n"));
}

TEST(SideLogin, AServerDoesNotRenewAtAClient) {
  Script s(client());
  s.give(TimePassed{});
  s.be_welcomed(1);
  s.did();
  s.say(1, Renew{"token", "a"});
  EXPECT_EQ(s.did(), "close 1 4009\n");
}

TEST(SideLogin, AWithdrawnCredentialEndsItsLinksAtOnceAndNoOthers) {
  Script s(server());
  s.login(1, {}, anna());
  s.login(2, {}, {"bert", {}, 0, "token:2"});
  const Token128 lost = s.login(3, {}, anna());
  s.lose(3);
  s.did();
  s.give(changed(std::nullopt, "token:3"));
  EXPECT_EQ(s.did(), "");
  s.give(changed(std::nullopt));
  EXPECT_EQ(s.did(), "close 1 4015\n");
  EXPECT_THAT(s.logged, HasSubstr("the login of anna was withdrawn (revoked)"));
  s.pass(1);
  ASSERT_EQ(s.status().links.size(), 1U);  // a lost link is not continued either
  EXPECT_EQ(s.status().links[0].identity, "bert");
  EXPECT_NE(s.login(4, lost, anna()), lost);
}

TEST(SideLogin, ChangedGroupsChangeRightsAtOnce) {
  Script s(for_ops());
  s.graph({topic("/a").pub(1)});
  s.login(1, {}, anna(0, {"ops"}));
  s.say(1, Accepts{{{{"/**"}, {}}}, {}});
  EXPECT_THAT(s.said(1), HasSubstr("/a"));
  s.give(changed(anna()));
  EXPECT_EQ(s.said(1), "accepts 0 rules\nwithdraw 1 not_permitted\n");
  s.give(changed(anna(0, {"ops"})));
  EXPECT_THAT(s.said(1), HasSubstr("offer 2/a"));
}

TEST(SideLogin, ANewEndHoldsAtOnce) {
  Script s(server());
  s.login(1, {}, anna());
  s.did();
  s.give(changed(anna(flow_test::at_ms(400))));
  s.pass_to(400);
  EXPECT_EQ(s.did(), "close 1 4013\n");
}

// ---- a client

// The server that answers is what the rules go by, on the same link too.
TEST(SideLogin, AClientsRulesMayNameTheServer) {
  Rule for_desk = rule({"/a"}, {});
  for_desk.identities = {"desk"};
  Rule for_ops = rule({"/b"}, {});
  for_ops.groups = {"ops"};
  Script s(client({for_desk, for_ops}));
  s.graph({topic("/a").pub(1), topic("/b").pub(2)});
  s.give(TimePassed{});
  const auto offers = [&](std::uint32_t connection) {
    s.be_welcomed(connection);
    s.say(connection, Accepts{{{{"/**"}, {}}}, {}});
    return s.said(connection);
  };
  s.server_is.name = "desk";
  const std::string desk = offers(1);
  EXPECT_THAT(desk, HasSubstr("/a"));
  EXPECT_THAT(desk, Not(HasSubstr("/b")));
  s.did();
  EXPECT_THAT(s.logged, HasSubstr(", which rules call desk"));
  EXPECT_EQ(s.status().links[0].identity, "desk");
  s.lose(1);
  s.pass(1000);
  s.server_is.groups = {"ops"};
  s.server_is.name = "another";
  const std::string another = offers(2);
  EXPECT_THAT(another, Not(HasSubstr("/a")));
  EXPECT_THAT(another, HasSubstr("/b"));
}

SideOptions with_token() {
  auto options = client();
  options.login_method = "token";
  options.credential = {'o', 'l', 'd'};
  return options;
}

Bytes bytes(const std::string& text) {
  return {text.begin(), text.end()};
}

TEST(SideLogin, AClientRenewsItsLoginWhenItsCredentialChanges) {
  Script s(with_token());
  s.give(TimePassed{});
  s.be_welcomed(1);
  s.said(1);
  s.give(CredentialChanged{bytes("new")});
  EXPECT_EQ(s.said(1), "renew token new\n");
  s.give(CredentialChanged{bytes("newer")});
  s.give(CredentialChanged{bytes("newest")});
  EXPECT_EQ(s.said(1), "");  // one after the other
  s.say(1, Renewed{true});
  EXPECT_EQ(s.said(1), "renew token newest\n");
  s.say(1, Renewed{false});
  s.did();
  EXPECT_THAT(s.logged, HasSubstr("refuses the new credential"));
  s.say(1, Renewed{true});  // nobody asked
  EXPECT_EQ(s.said(1), "");
}

TEST(SideLogin, AClientDialsWithTheNewCredentialAndDoesNotWaitForIt) {
  Script s(with_token());
  s.give(TimePassed{});
  s.be_welcomed(1);
  s.lose(1, 4015);
  s.did();
  s.pass(1000);
  EXPECT_EQ(s.did(), "");  // with the old one it waits
  s.give(CredentialChanged{bytes("new")});
  EXPECT_EQ(s.did(), "dial 2\n");
  s.give(ConnectionOpened{{2}, "10.0.0.1"});
  static_cast<void>(s.side.next_packet({2}, {}));
  const auto login = decode_login(flow_test::joined(*s.side.next_packet({2}, {})));
  ASSERT_TRUE(login);
  EXPECT_EQ(login.value().credential, bytes("new"));
}

TEST(SideLogin, AClientSaysWhatItNeeds) {
  for (const auto& [code, words] :
       {std::pair{4003, "lost; the server's log says why. The next try"},
        std::pair{4013, "lost; another credential is needed"},
        std::pair{4015, "lost; the server's log says why. The next try"}}) {
    Script s(with_token());
    s.give(TimePassed{});
    s.be_welcomed(1);
    s.lose(1, static_cast<std::uint16_t>(code));
    s.did();
    EXPECT_THAT(s.logged, HasSubstr(words));
    EXPECT_THAT(s.logged, HasSubstr("in a file, a new one there is used at once"));
  }
}

}  // namespace
}  // namespace connect_bridge::side_test
