// Wrong logins that are too many, and identities whose links offend.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

using testing::HasSubstr;

Identity called(const std::string& name) {
  Identity who;
  who.name = name;
  return who;
}

class Door {
 public:
  explicit Door(const SideOptions& options) : s(options) {}

  // Up to the answer of the login method, and what is done then.
  std::string tries(std::uint32_t connection, const std::string& address,
                    const std::optional<Identity>& who, int share = 1, bool judged = true) {
    s.give(ConnectionOpened{{connection}, address + ":50000", address, share});
    s.binary(connection, encode(Hello{1, 1, Script::peer_id(connection), {}, "/peer"}));
    s.binary(connection, encode(Login{"token", {}}));
    s.did();
    s.give(Authenticated{{connection}, who, "unknown token", judged});
    return s.did();
  }

  Script s;
};

std::string refused(std::uint32_t connection) {
  return "close " + std::to_string(connection) + " 4003\n";
}

SideOptions strict() {
  SideOptions options = server();
  options.address_wrong_logins_at_once = 2;
  options.address_wrong_login_period = std::chrono::seconds(20);
  options.wrong_logins_at_once = 5;
  options.wrong_login_period = std::chrono::seconds(20);
  return options;
}

TEST(Strangers, WrongLoginsOfAnAddressAreAnsweredLateWhenTheyAreTooMany) {
  SideOptions options = strict();
  options.audits = true;
  Door door(options);
  EXPECT_EQ(door.tries(1, "10.0.0.9", {}), refused(1));
  EXPECT_EQ(door.tries(2, "10.0.0.9", {}), refused(2));
  EXPECT_EQ(door.tries(3, "10.0.0.9", {}), "");
  EXPECT_EQ(door.tries(4, "10.0.0.8", {}), refused(4)) << "it is another address";
  EXPECT_EQ(door.tries(5, "10.0.0.9", called("anna")), "gate 5\n") << "a right login gets in";
  EXPECT_EQ(door.s.status().strangers.wrong_logins, 4U);
  EXPECT_EQ(door.s.status().strangers.wrong_logins_late, 1U);
  EXPECT_EQ(door.s.status().strangers.waiting, 1U);
  door.s.lose(5);
  door.s.pass(2999);
  EXPECT_EQ(door.s.did(), "");
  door.s.noted.clear();
  door.s.pass(1);
  EXPECT_EQ(door.s.did(), refused(3));
  EXPECT_THAT(door.s.noted, HasSubstr("there are too many wrong logins"));
  EXPECT_EQ(door.s.status().strangers.waiting, 0U);
  door.s.pass(17'001);
  door.s.did();
  EXPECT_EQ(door.tries(6, "10.0.0.9", {}), refused(6));
  EXPECT_EQ(door.tries(7, "10.0.0.9", {}), "");
}

// Of several addresses that are one customer's, all in one line.
TEST(Strangers, WhoLogsInTakesTurnsByItsCustomer) {
  Script s(server());
  s.give(ConnectionOpened{{1}, "[2001:db8:0:5::1]:50000", "2001:db8:0:5::", 1, "2001:db8::/56"});
  s.binary(1, encode(Hello{1, 1, Script::peer_id(1), {}, "/peer"}));
  s.did();
  s.binary(1, encode(Login{"token", {}}));
  EXPECT_EQ(s.did(), "authenticate 1 token turn 2001:db8::/56\n");
}

// The login method is down, or has too much to do: nobody has shown anything wrong.
TEST(Strangers, WhatWasNotJudgedIsNoWrongLogin) {
  Door door(strict());
  for (std::uint32_t i = 1; i <= 8; ++i) {
    EXPECT_EQ(door.tries(i, "10.0.0.9", {}, 1, false),
              "close " + std::to_string(i) + " 4016\n");  // it is worth trying again
  }
  EXPECT_EQ(door.s.status().strangers.wrong_logins, 0U);
  EXPECT_EQ(door.s.status().strangers.logins_not_judged, 8U);
  EXPECT_EQ(door.tries(9, "10.0.0.9", {}), refused(9));
}

TEST(Strangers, AnAddressMayHaveTheShareOfSeveral) {
  Door door(strict());
  for (std::uint32_t i = 1; i <= 4; ++i) EXPECT_EQ(door.tries(i, "127.0.0.1", {}, 2), refused(i));
  EXPECT_EQ(door.tries(5, "127.0.0.1", {}, 2), "");
}

// It takes the place of a connection without a login for as long as it waits.
TEST(Strangers, WhoWaitsForALateAnswerGivesWay) {
  SideOptions options = strict();
  options.strangers_max = 8;
  Door door(options);
  for (std::uint32_t i = 1; i <= 10; ++i) door.tries(i, "10.0.0.9", {});
  EXPECT_EQ(door.s.status().strangers.waiting, 8U);
  EXPECT_EQ(door.tries(11, "10.0.0.9", called("anna")), "gate 11\n");
  EXPECT_EQ(door.s.status().strangers.gave_way, 1U);
}

// ---- offences

const Bytes kNoPacket{0, 0, 0, 0, 0, 0, 0, 0};

SideOptions patient() {
  SideOptions options = server();
  options.account.offences_at_once = 2;
  options.account.offence_period = std::chrono::seconds(2);
  return options;
}

// What is done when this identity logs in.
std::string logs_in(Script& s, std::uint32_t connection, const std::string& who) {
  s.login(connection, {}, called(who));
  return s.did();
}

std::string let_in(std::uint32_t connection) {
  const std::string number = std::to_string(connection);
  return "authenticate " + number + " none\ngate " + number + "\n";
}

void offend(Script& s, std::uint32_t connection) {
  s.binary(connection, kNoPacket);
  EXPECT_EQ(s.did(), "close " + std::to_string(connection) + " 4002\n");
}

TEST(Strangers, WhoOffendsAgainAndAgainWaitsForItsNextLogin) {
  Script s(patient());
  s.give(TimePassed{});
  s.did();
  for (std::uint32_t i = 1; i <= 2; ++i) {
    EXPECT_EQ(logs_in(s, i, "hostile"), let_in(i));
    offend(s, i);
  }
  s.pass(500);
  s.did();
  EXPECT_EQ(logs_in(s, 3, "hostile"), "authenticate 3 none\n");
  EXPECT_EQ(logs_in(s, 4, "anna"), let_in(4)) << "it is another identity";
  EXPECT_EQ(s.status().strangers.shut_out, 1U);
  s.pass(1499);
  EXPECT_EQ(s.did(), "");
  s.pass(1);
  EXPECT_EQ(s.did(), "gate 3\n");
}

TEST(Strangers, WhoMustWaitForLongIsRefusedInTheEnd) {
  Script s(patient());
  for (std::uint32_t i = 1; i <= 8; ++i) s.login(i, {}, called("hostile"));
  s.did();
  for (std::uint32_t i = 1; i <= 8; ++i) offend(s, i);
  s.logged.clear();
  EXPECT_EQ(logs_in(s, 9, "hostile"), "authenticate 9 none\n");
  s.pass(4999);
  s.did();
  EXPECT_THAT(s.logged, Not(HasSubstr("offences")));
  s.pass(1);
  EXPECT_EQ(s.did(), "close 9 4012\n");
  EXPECT_EQ(s.status().strangers.logins_without_place, 1U);
  EXPECT_THAT(s.logged, HasSubstr("offences"));
  s.pass(60'000);
  s.did();
  EXPECT_EQ(logs_in(s, 10, "hostile"), let_in(10)) << "it does not wait for ever";
}

// A token may be that of several: who of them has done nothing goes on after a break.
TEST(Strangers, ALinkThatHasNotOffendedGoesOnAtOnce) {
  Script s(patient());
  const Token128 session = s.login(1, {}, called("shared"));
  for (std::uint32_t i = 2; i <= 5; ++i) s.login(i, {}, called("shared"));
  s.did();
  for (std::uint32_t i = 2; i <= 5; ++i) offend(s, i);
  s.lose(1);
  s.did();
  s.login(6, session, called("shared"));
  EXPECT_EQ(s.did(), let_in(6));
  offend(s, 6);
  s.login(7, session, called("shared"));
  EXPECT_EQ(s.did(), "authenticate 7 none\n");
}

TEST(Strangers, SilenceIsNoOffence) {
  Script s(patient());
  for (std::uint32_t i = 1; i <= 4; ++i) {
    s.login(i, {}, called("unlucky"));
    s.fall_silent(i);
    s.pass(5000);
    EXPECT_THAT(s.did(), HasSubstr("close " + std::to_string(i) + " 4008\n"));
  }
  EXPECT_EQ(logs_in(s, 5, "unlucky"), let_in(5));
}

}  // namespace
}  // namespace connect_bridge::side_test
