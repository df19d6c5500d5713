// A side as a whole: dialing, logins, changed rules, the clock, the end.
#include "core/side/side.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

TEST(Side, BeginsWithItsClaimAndAClientDials) {
  Script s(client());
  EXPECT_EQ(s.did(), std::string("mirror 1 ") + kClaimsTopic + " reliable latched 1\nsubscribe 1 " +
                         kClaimsTopic + " reliable latched 100\n");
  EXPECT_EQ(s.side.next_deadline(), TimePoint{});
  s.give(TimePassed{});
  EXPECT_EQ(s.did(), "dial 1\nclaim []\n");
  EXPECT_EQ(s.side.next_deadline(), TimePoint{} + std::chrono::seconds(3));  // a sign of life
}

TEST(Side, ALinkTellsForHowLongItIsOpen) {
  Script s(server());
  s.pass(1000);
  const Token128 session = s.join(1);
  s.pass(2500);
  EXPECT_EQ(s.status().links.at(0).open_for, std::chrono::milliseconds(2500));
  s.lose(1);
  s.pass(100);
  EXPECT_EQ(s.status().links.at(0).open_for, Duration::zero());
  s.join(2, session);
  s.pass(700);
  EXPECT_EQ(s.status().links.at(0).open_for, std::chrono::milliseconds(700));
}

TEST(Side, AServerDoesNotDial) {
  Script s(server());
  s.give(TimePassed{});
  s.pass(10'000);
  EXPECT_EQ(s.did().find("dial"), std::string::npos);
}

TEST(Side, AFailedDialIsTriedAgain) {
  Script s(client());
  s.give(TimePassed{});
  s.did();
  s.give(DialFailed{{1}, {Cause::kPortClosed, "refused"}});
  s.pass(99);
  EXPECT_EQ(s.did(), "");
  s.pass(101);
  EXPECT_EQ(s.did(), "dial 2\n");
  s.give(DialFailed{{1}, {Cause::kPortClosed, "an old one"}});
  s.pass(10'000);
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.status().last_failure, (Failure{Cause::kPortClosed, "refused"}));
}

TEST(Side, WhyTheServerClosedIsACause) {
  const auto last_failure = [](std::optional<std::uint16_t> code) {
    Script s(client());
    s.give(TimePassed{});
    s.give(ConnectionOpened{{1}, "10.0.0.1"});
    s.give(ConnectionClosed{{1}, code, "it", Cause::kAddressGone});
    return s.status().last_failure;
  };
  EXPECT_EQ(last_failure(4003), (Failure{Cause::kLoginRefused, "it says: it"}));
  EXPECT_EQ(last_failure(1011), (Failure{Cause::kClosed, "it says: it"}));
  EXPECT_EQ(last_failure({}), (Failure{Cause::kAddressGone, "it"}));
}

TEST(Side, TheCauseDecidesWhenItDialsAgain) {
  const auto dials_within = [](Cause cause, std::int64_t ms) {
    Script s(client());
    s.give(TimePassed{});
    s.did();
    s.give(DialFailed{{1}, {cause, "it"}});
    s.pass(ms);
    return s.did().find("dial 2") != std::string::npos;
  };
  EXPECT_TRUE(dials_within(Cause::kPortClosed, 1000));
  EXPECT_TRUE(dials_within(Cause::kProxyWithoutServer, 1000));
  EXPECT_FALSE(dials_within(Cause::kLoginRefused, 4000));
  EXPECT_TRUE(dials_within(Cause::kLoginRefused, 8000));
  EXPECT_FALSE(dials_within(Cause::kOtherKey, 100'000)) << "another server is there";
}

TEST(Side, AfterAChangeOfTheNetworkItDialsAtOnce) {
  Script s(client());
  s.give(TimePassed{});
  for (std::uint32_t dial = 1; dial < 8; ++dial) {
    s.give(DialFailed{{dial}, {Cause::kPortClosed, "refused"}});
    s.pass(1500);
  }
  s.give(DialFailed{{8}, {Cause::kPortClosed, "refused"}});
  s.did();
  s.give(NetworkChanged{});
  EXPECT_EQ(s.did(), "dial 9\n");
  s.give(NetworkChanged{});  // one at a time
  EXPECT_EQ(s.did(), "");
  s.give(DialFailed{{9}, {Cause::kPortClosed, "unreachable"}});  // the next one follows soon
  s.pass(200);
  EXPECT_EQ(s.did(), "dial 10\n");
}

// A container that comes or goes concerns nobody; a slow path would not answer in time.
TEST(Side, OnlyAfterAChangeOfItsRouteTheServerMustAnswerSoon) {
  Script s(client());
  s.give(TimePassed{});
  s.be_welcomed(1);
  s.fall_silent(1);
  s.did();
  s.give(NetworkChanged{false});
  s.pass(1500);
  EXPECT_EQ(s.did().find("close"), std::string::npos);
  s.give(NetworkChanged{true});
  s.pass(999);
  EXPECT_EQ(s.did().find("close"), std::string::npos);
  s.pass(1);
  EXPECT_NE(s.did().find("close"), std::string::npos);
}

TEST(Side, ARefusedLoginIsTriedAgainAfterFiveSeconds) {
  for (const std::uint16_t code : {4001, 4003, 4012, 4015, 4016}) {
    Script s(client());
    s.give(TimePassed{});
    s.give(ConnectionOpened{{1}, "10.0.0.1"});
    s.did();
    s.lose(1, code);
    s.give(NetworkChanged{});
    s.pass(4999);
    EXPECT_EQ(s.did(), "") << code;
    s.pass(2501);
    EXPECT_EQ(s.did(), "dial 2\n") << code;
  }
}

TEST(Side, AClientPresentsItsSession) {
  Script s(client());
  s.give(TimePassed{});
  s.be_welcomed(1);
  EXPECT_EQ(s.said(1), "accepts 1 rules\n");
  s.lose(1);
  s.pass(200);
  s.give(ConnectionOpened{{2}, "10.0.0.1"});
  const auto hello = decode_hello(flow_test::joined(*s.side.next_packet({2}, {})));
  ASSERT_TRUE(hello);
  EXPECT_EQ(hello.value().session, Script::peer_id(77));
}

TEST(Side, TheLogTellsHowALinkComesBack) {
  for (const bool kept : {true, false}) {
    Script s(client());
    s.give(TimePassed{});
    s.be_welcomed(1);
    s.lose(1);
    s.pass(kept ? 500 : 10'000);
    s.be_welcomed(2, 0, Script::peer_id(kept ? 77 : 78));
    s.did();
    EXPECT_NE(s.logged.find(kept ? "it resumes after a break"
                                 : "it starts again, nothing had to be kept"),
              std::string::npos)
        << s.logged;
  }
}

TEST(Side, ALinkThatEndsAtOnceIsDialedSlowerAndSlower) {
  Script s(client());
  s.give(TimePassed{});
  std::int64_t waited = 0;
  for (std::uint32_t dial = 1; dial <= 5; ++dial) {
    s.be_welcomed(dial);
    s.did();
    s.lose(dial);
    for (waited = 0; waited < 2000 && s.did().find("dial") == std::string::npos; ++waited)
      s.pass(1);
  }
  EXPECT_GE(waited, 250);
  s.be_welcomed(6);
  s.pass(5000);  // this one lived
  s.did();
  s.lose(6);
  s.pass(200);
  EXPECT_EQ(s.did(), "dial 7\n");
}

TEST(Side, ARefusedOrExpiredLoginIsClosedWithTheSameWords) {
  Script s(server());
  s.give(TimePassed{});
  s.did();
  std::vector<Authenticated> answers(2);
  answers[0] = {{1}, std::nullopt, "unknown token"};
  answers[1] = {{2}, Identity{"anna", {}, flow_test::at_ms(0)}, ""};
  for (const auto& answer : answers) {
    s.give(ConnectionOpened{answer.connection, "10.0.0.4"});
    s.binary(answer.connection.value, encode(Hello{1, 1, Script::peer_id(4), {}, "/peer"}));
    s.binary(answer.connection.value, encode(Login{"token", {}}));
    s.side.next_action();
    s.give(answer);
    while (const auto action = s.side.next_action()) {
      if (const auto* close = std::get_if<CloseConnection>(&*action)) {
        EXPECT_EQ(close->code, CloseCode::kLoginRefused);
        EXPECT_EQ(close->reason, "login refused");
      }
    }
  }
  EXPECT_TRUE(s.status().links.empty());
}

TEST(Side, CountsOutliveAConnection) {
  Script s(server());
  s.graph({topic("/a").pub(1)});
  Token128 session = s.join(1);
  for (std::uint32_t connection = 1; connection <= 3; ++connection) {
    s.demand(connection, connection);
    s.take(1 + connection, 1, "sent");
    s.said(connection);
    s.take(1 + connection, 1, "lost with the connection");
    s.lose(connection);
    s.join(connection + 1, session);
    const auto counts = s.status().links.at(0).topics.at(0);
    EXPECT_EQ(counts.messages, connection);
    EXPECT_EQ(counts.dropped.of(DropReason::kLinkLost), connection);
  }
}

TEST(Side, ChangedRulesWithdrawAndOffer) {
  Script s(server({rule({"/a", "/b"}, {})}));
  s.graph({topic("/a").pub(1), topic("/b").pub(2), topic("/c").pub(3)});
  s.join(1);
  s.demand(1, 1);
  EXPECT_EQ(s.did(), "subscribe 2 /a reliable volatile 100\n");
  s.take(2, 1, "discarded");
  s.give(PolicyChanged{Policy({rule({"/b", "/c"}, {"/x"})})});
  EXPECT_EQ(s.did(), "unsubscribe 2\n");
  EXPECT_EQ(s.said(1), "accepts 1 rules\nwithdraw 1 not_permitted\noffer 3/c[1]\n");
}

TEST(Side, AnotherTreatmentIsAnotherChannel) {
  Script s(server());
  s.graph({topic("/a").pub(1)});
  s.join(1);
  auto urgent = everything();
  urgent.treatment.priority = Priority::kUrgent;
  s.give(PolicyChanged{Policy({urgent})});
  EXPECT_EQ(s.said(1), "accepts 1 rules\nwithdraw 1\noffer 2/a[1]\n");
  s.give(PolicyChanged{Policy({urgent})});
  EXPECT_EQ(s.said(1), "accepts 1 rules\n");
}

TEST(Side, ChangedRulesDeclineWhatIsImported) {
  Script s(server());
  s.graph({topic("/a").sub(1)});
  s.pass(1000);
  s.join(1);
  s.say(1, Offer{{channel(1, "/a", {origin(1, 11)})}, true});
  EXPECT_EQ(s.said(1), "demand 1 on\n");
  s.did();
  s.give(PolicyChanged{Policy({rule({"/**"}, {})})});
  EXPECT_EQ(s.said(1), "accepts 0 rules\ndecline 1 not_permitted\ndemand 1 off\n");
  s.message(1, 1, 1, "was under way");
  s.pass(200);
  EXPECT_EQ(s.did(), "unmirror 2\nclaim []\n");
}

TEST(Side, StopsOnceAndForAll) {
  Script s(server());
  s.graph({topic("/a").pub(1), topic("/b").sub(2)});
  s.pass(1000);
  s.join(1);
  s.demand(1, 1);
  s.say(1, Offer{{channel(1, "/b", {origin(1, 11)})}, true});
  s.give(ConnectionOpened{{2}, "10.0.0.2"});
  s.did();
  s.give(StopRequested{});
  EXPECT_EQ(s.did(),
            "close 2 1001\nclose 1 1001\nunsubscribe 2\nunmirror 2\nclaim [] and ends\nstopped\n");
  s.give(StopRequested{});
  s.graph({});
  s.give(ConnectionOpened{{3}, "10.0.0.3"});
  EXPECT_EQ(s.did(), "");
  EXPECT_FALSE(s.side.next_deadline());
}

TEST(Side, AClientThatStopsDialsNoMore) {
  Script s(client());
  s.give(TimePassed{});
  s.be_welcomed(1);
  s.did();
  s.give(StopRequested{});
  EXPECT_EQ(s.did(), "close 1 1001\nclaim [] and ends\nstopped\n");
  s.lose(1);
  s.pass(10'000);
  EXPECT_EQ(s.did(), "");
}

TEST(Side, InputsOfUnknownConnectionsAreIgnored) {
  Script s(server());
  s.give(TimePassed{});
  s.did();
  s.give(PacketReceived{{9}, false, {}});
  s.give(ConnectionClosed{{9}, {}, ""});
  s.give(DialFailed{{9}, {Cause::kPortClosed, ""}});
  s.give(Authenticated{{9}, Identity{}, ""});
  s.give(JobDone{{9}, {}});
  s.give(MessageTaken{{9}, {}, 0, {}});
  s.give(MessageTaken{{1}, {}, 0, sample("no claim")});
  s.give(MessagesLost{{9}, 1, false});
  s.give(SubscriptionFailed{{9}, "", ""});
  s.give(MirrorFailed{{9}, "", ""});
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.said(9), "");
}

TEST(Side, AnIncompatiblePairIsToldOnce) {
  Script s(server());
  for (int i = 0; i < 3; ++i) s.give(QosIncompatible{{}, "/a", "durability"});
  s.did();
  EXPECT_EQ(s.logged, "/a: a publisher here offers an incompatible durability\n");
}

TEST(Side, TheSameSeedAndInputsGiveTheSameActions) {
  std::string did[2];
  for (auto& words : did) {
    Script s(client());
    s.give(TimePassed{});
    for (std::uint32_t dial = 1; dial < 20; ++dial) {
      words += s.did();
      s.give(DialFailed{{dial}, {Cause::kPortClosed, "refused"}});
      words += std::to_string((*s.side.next_deadline() - TimePoint{}).count()) + "\n";
      s.pass(1500);
    }
  }
  EXPECT_NE(did[0].find("dial 19\n"), std::string::npos);
  EXPECT_EQ(did[0], did[1]);
}

}  // namespace
}  // namespace connect_bridge::side_test
