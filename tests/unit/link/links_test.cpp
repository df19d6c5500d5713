// Which connection carries which link, and what the end of one means.
#include "core/link/links.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <variant>

#include "core/wire/frame.hpp"
#include "unit/link/quiet_user.hpp"
#include "unit/link/script.hpp"

namespace connect_bridge::link_test {
namespace {

struct Notices final : QuietUser {
  void on_link_open(Link& link, const Now&) override { note("open", link); }
  void on_peer_replaced(Link& link, const Now&) override { note("replaced", link); }
  [[nodiscard]] bool on_link_lost(Link& link, const Now&) override { return end("lost", link); }
  [[nodiscard]] bool on_link_dead(Link& link, const Now&) override { return end("dead", link); }
  void on_link_forgotten(Link& link, const Now&) override { note("forgotten", link); }
  void on_session_forgotten(Link& link, const Now&) override { note("session_forgotten", link); }
  [[nodiscard]] bool resumes(const Link&) const override { return keeps; }

  // Each link has so many entries that are lost, and that die.
  bool end(const std::string& word, Link& link) {
    const auto some = [&] {
      std::size_t& ended = ends[link.id];
      for (; ended < entries; ++ended)
        if (!link.end.take()) return false;
      ends.erase(link.id);
      return true;
    };
    const bool over = link.end.part(0, some);
    note(over ? word : "partly " + word, link);
    return over;
  }
  void note(const std::string& word, const Link& link) {
    words += (words.empty() ? "" : ", ") + word + " " + std::to_string(link.id.value);
  }

  std::string words;
  std::size_t entries = 0;
  std::map<LinkId, std::size_t> ends;
  bool keeps = false;  // something, for every link
};

// A side's links without the side. Time in milliseconds.
struct Carried {
  explicit Carried(LinkOptions with = {}) : options(std::move(with)) {}

  void connect(std::uint64_t n, std::int64_t at = 0) {
    ConnectionOpened opened{{n}, "10.0.0.2:" + std::to_string(n)};
    links.on(opened, now_ms(at));
    links.settle(now_ms(at));
  }
  void packet(std::uint64_t n, Bytes bytes, std::int64_t at = 0) {
    PacketReceived received{{n}, false, Payload::adopt(std::move(bytes))};
    links.on(received, now_ms(at));
    links.settle(now_ms(at));
  }
  void judge(std::uint64_t n, const std::string& identity, std::int64_t at = 0) {
    Authenticated answer{{n}, Identity{identity, {}, 0, "key of " + identity}, ""};
    links.on(answer, now_ms(at));
    links.settle(now_ms(at));
  }
  // Connection n logs in, perhaps with a session.
  void enter(std::uint64_t n, const std::string& identity, std::int64_t at = 0,
             Token128 session = {}, std::uint8_t side = kPeer) {
    connect(n, at);
    packet(n, encode(Hello{kProtocolVersion, kProtocolVersion, token(side), session, "/peer"}), at);
    packet(n, login(), at);
    judge(n, identity, at);
  }
  void lose(std::uint64_t n, std::int64_t at, std::optional<std::uint16_t> code = {}) {
    ConnectionClosed closed{{n}, code, ""};
    links.on(closed, now_ms(at));
    links.settle(now_ms(at));
  }
  void pass(std::int64_t at) {
    static_cast<void>(links.on_time(now_ms(at)));
    links.settle(now_ms(at));
  }
  void withdraw_login(const std::string& identity, std::int64_t at) {
    IdentitiesChanged changed{{{"key of " + identity, std::nullopt}}};
    links.on(changed, now_ms(at));
    links.settle(now_ms(at));
  }
  // The connections that have something to send.
  std::string ready() {
    std::string ids;
    while (const auto connection = links.take_ready())
      ids += std::to_string(connection->value) + " ";
    return ids;
  }
  // What was noticed: "open 1, lost 1".
  std::string noticed() { return std::exchange(user.words, ""); }
  // What this side asked for: "dial 1", "close 2 replaced".
  std::string asked() {
    std::string words;
    while (const auto action = outputs.next()) {
      std::string word;
      if (const auto* dial = std::get_if<Dial>(&*action))
        word = "dial " + std::to_string(dial->connection.value);
      if (const auto* close = std::get_if<CloseConnection>(&*action))
        word = "close " + std::to_string(close->connection.value) + " " +
               std::string(name_of(close->code));
      if (!word.empty()) words += (words.empty() ? "" : ", ") + word;
    }
    return words;
  }
  Link& link(std::uint64_t n) { return links.all().at({n}); }

  LinkOptions options;
  Random random{1};
  Outputs outputs;
  Notices user;
  Links links{options, token(kOwn), random, outputs, user};
};

TEST(Links, OnlyWhoHasSomethingToSendIsAsked) {
  Carried s;
  for (const std::uint64_t n : {1, 2}) s.enter(n, "anna" + std::to_string(n), 0, {}, kPeer + n);
  EXPECT_EQ(s.ready(), "1 2 ");  // the welcomes
  for (const std::uint64_t n : {1, 2})
    while (s.links.next_packet({n}, now_ms(0))) {
    }
  EXPECT_EQ(s.ready(), "");
  Bytes asks;
  append_header(TimeRequest{1}, asks);
  s.packet(2, asks, 1);
  EXPECT_EQ(s.ready(), "2 ");
  s.lose(2, 2);
  s.packet(1, asks, 3);
  s.lose(1, 3);
  EXPECT_EQ(s.ready(), "");
}

TEST(Links, ALimitThatChangesDuringALoginHolds) {
  Carried s;
  s.connect(1);
  s.options.outbox.bytes_per_second_max = 50'000;  // as the side does
  s.links.on(LimitsChanged{0, 50'000, {}, 0}, now_ms(0));
  s.packet(1, hello());
  s.packet(1, login());
  s.judge(1, "anna");
  EXPECT_EQ(s.link(1).outbox().assumed_rate(), 50'000);
}

TEST(Links, ALimitThatBeginsFindsNothingOwed) {
  Carried s;
  s.enter(1, "anna");
  while (s.links.next_packet({1}, now_ms(0))) {
  }
  LimitsChanged limits;
  limits.bytes_per_second_max = 1000;
  s.links.on(limits, now_ms(100));
  EXPECT_EQ(s.link(1).outbox().assumed_rate(), 1000);
}

TEST(Links, ASessionGoesOnOnAnotherConnection) {
  Carried s;
  s.enter(1, "anna");
  const Token128 session = s.link(1).login.session();
  EXPECT_TRUE(session);
  s.lose(1, 1000);
  s.enter(2, "anna", 2000, session);
  EXPECT_EQ(s.noticed(), "open 1, lost 1, open 1");
  s.lose(2, 3000);
  s.enter(3, "anna", 3000, session, kPeer + 1);  // a process that remembers no call
  EXPECT_EQ(s.noticed(), "lost 1, replaced 1, open 1");
  EXPECT_EQ(s.links.all().size(), 1U);
}

// A session secret is no credential.
TEST(Links, TheLastBreaksAreKeptWithTimeAndReason) {
  Carried s;
  s.enter(1, "anna");
  const Token128 session = s.links.all().begin()->second.login.session();
  const Link& link = s.links.all().begin()->second;
  EXPECT_TRUE(link.status().breaks.empty());
  for (std::uint64_t n = 1; n <= 10; ++n) {
    const auto at = static_cast<std::int64_t>(100 * n);
    s.lose(n, at, 1011);
    EXPECT_EQ(link.status().breaks.back().back, 0);
    EXPECT_FALSE(link.status().breaks.back().why.text.empty());
    s.enter(n + 1, "anna", at + 50, session);
  }
  const auto breaks = link.status().breaks;
  ASSERT_EQ(breaks.size(), LinkBreak::kShownMax);
  EXPECT_EQ(breaks.front().lost, now_ms(300).system);
  EXPECT_EQ(breaks.back().lost, now_ms(1000).system);
  EXPECT_EQ(breaks.back().back, now_ms(1050).system);
}

// A server is not without links because one has ended.
TEST(Links, AServersFailureIsThatOfItsLastLink) {
  Carried s;
  const auto failure = [&] {
    Status status;
    s.links.add_status(status);
    return status.last_failure.cause;
  };
  s.enter(1, "anna");
  s.enter(2, "bert", 0, {}, kPeer + 1);
  s.lose(1, 100, 1011);
  EXPECT_EQ(failure(), Cause::kNone) << "another is open";
  s.lose(2, 200, 1011);
  EXPECT_EQ(failure(), Cause::kClosed);
  s.enter(3, "anna", 300);
  EXPECT_EQ(failure(), Cause::kNone);
  ConnectionClosed closed{{3}, 1001, "the peer is stopping"};
  s.links.on(closed, now_ms(400));
  EXPECT_EQ(failure(), Cause::kNone) << "in order";
}

TEST(Links, TheSessionOfAnotherIdentityGoesOnForNobodyElse) {
  Carried s;
  s.enter(1, "anna");
  const Token128 session = s.link(1).login.session();
  s.enter(2, "bert", 1000, session);
  EXPECT_EQ(s.noticed(), "open 1, open 2");
  EXPECT_EQ(s.link(1).login.identity().name, "anna");
  EXPECT_EQ(s.link(1).connection()->id(), ConnectionId{1});
  EXPECT_NE(s.link(2).login.session(), session);
  EXPECT_EQ(s.asked(), "");
}

TEST(Links, ANewerConnectionOfASessionTakesOver) {
  Carried s;
  s.enter(1, "anna");
  s.enter(2, "anna", 1000, s.link(1).login.session());
  EXPECT_EQ(s.noticed(), "open 1, lost 1, open 1");
  EXPECT_EQ(s.asked(), "close 1 replaced");
  s.packet(1, {0xff}, 1100);  // what was on its way
  s.lose(1, 1200);
  EXPECT_EQ(s.noticed(), "");
  EXPECT_EQ(s.link(1).connection()->id(), ConnectionId{2});
  EXPECT_TRUE(s.link(1).open());
  EXPECT_FALSE(s.link(1).life.waits());
}

TEST(Links, ALostLinkIsDeadAfterSilenceAndForgottenIfNothingIsKeptForIt) {
  Carried s;
  s.enter(1, "anna");
  s.lose(1, 1000);
  EXPECT_EQ(s.links.deadline(), now_ms(3000).steady);  // it was heard at 0
  s.pass(2999);
  EXPECT_EQ(s.noticed(), "open 1, lost 1");
  s.pass(3000);
  EXPECT_EQ(s.noticed(), "dead 1, forgotten 1");
  EXPECT_TRUE(s.links.all().empty());
  EXPECT_FALSE(s.links.deadline());
}

// Two links that have told much, where a step ends 10 entries of 25.
struct Ending : Carried {
  Ending() : Carried(ten_at_once()) {
    user.entries = 25;
    enter(1, "anna");
    enter(2, "bert", 0, {}, kPeer + 1);
    session = link(1).login.session();
    noticed();
  }
  static LinkOptions ten_at_once() {
    LinkOptions options;
    options.ends_at_once = 10;
    return options;
  }
  Token128 session;
};

TEST(Links, WhatHasToldMuchEndsInSeveralSteps) {
  Ending s;
  s.lose(1, 1000);
  EXPECT_EQ(s.noticed(), "partly lost 1");
  EXPECT_FALSE(s.link(1).open());
  EXPECT_EQ(s.link(1).deadline(), now_ms(1000).steady);
  s.pass(1000);
  EXPECT_EQ(s.noticed(), "partly lost 1");
  s.pass(1001);
  EXPECT_EQ(s.noticed(), "lost 1");
  EXPECT_FALSE(s.link(1).connection());
  EXPECT_EQ(s.link(1).deadline(), now_ms(3000).steady);
  s.lose(2, 1002, 1001);  // it will not return
  EXPECT_EQ(s.noticed(), "partly lost 2");
  for (int n = 0; n < 5; ++n) s.pass(1003 + n);
  EXPECT_EQ(s.noticed(),
            "partly lost 2, lost 2, partly dead 2, partly dead 2, dead 2, forgotten 2");
}

TEST(Links, LinksThatEndTogetherTakeTurns) {
  Ending s;
  s.lose(1, 1000);
  s.lose(2, 1001);
  s.noticed();
  for (int n = 0; n < 4; ++n) s.pass(1002 + n);
  EXPECT_EQ(s.noticed(), "partly lost 1, partly lost 2, lost 1, lost 2");
}

TEST(Links, WhatIsLeftOfALinkEndsBeforeSomethingElseHappensToIt) {
  Ending back;
  back.lose(1, 1000);
  back.noticed();
  back.enter(3, "anna", 1000, back.session);
  EXPECT_EQ(back.noticed(), "lost 1, open 1");
  EXPECT_TRUE(back.link(1).open());
  Ending withdrawn;
  withdrawn.lose(1, 1000);
  withdrawn.noticed();
  withdrawn.withdraw_login("anna", 1000);
  EXPECT_EQ(withdrawn.noticed(), "lost 1");
  Ending stopped;
  stopped.lose(1, 1000);
  stopped.noticed();
  stopped.links.stop(now_ms(1000));
  EXPECT_EQ(stopped.noticed(), "lost 1, partly lost 2, lost 2, dead 2");
  Ending full;
  full.options.links_max = 2;
  full.lose(1, 1000);
  full.noticed();
  full.enter(3, "carl", 1000);
  EXPECT_EQ(full.noticed(), "lost 1, partly dead 1, dead 1, forgotten 1, open 3");
}

// The rights of the others stay as they are.
TEST(Links, OnlyWhoseIdentityChangesEndsAtOnce) {
  Ending s;
  s.lose(1, 1000);
  s.lose(2, 1000);
  s.noticed();
  IdentitiesChanged nothing;
  s.links.on(nothing, now_ms(1000));
  EXPECT_EQ(s.noticed(), "");
  s.withdraw_login("anna", 1000);
  EXPECT_EQ(s.noticed(), "lost 1");
}

TEST(Links, WhatIsLeftEndsAtOnceAfterTwoSeconds) {
  Ending s;
  s.lose(1, 1000);
  s.pass(2999);
  EXPECT_EQ(s.noticed(), "partly lost 1, partly lost 1");
  s.user.entries = 1000;
  s.pass(3000);
  EXPECT_EQ(s.noticed(), "lost 1");
}

TEST(Links, ADeadLinkForWhichSomethingIsKeptMayReturn) {
  LinkOptions options;
  options.resume_for = std::chrono::seconds(10);
  Carried s(options);
  s.user.keeps = true;
  s.enter(1, "anna");
  const Token128 session = s.link(1).login.session();
  s.lose(1, 1000);
  s.pass(3000);
  s.pass(10'999);
  EXPECT_EQ(s.noticed(), "open 1, lost 1, dead 1");
  s.enter(2, "anna", 10'999, session);
  EXPECT_EQ(s.noticed(), "open 1");
  s.lose(2, 10'999);
  s.pass(20'999);
  EXPECT_EQ(s.noticed(), "lost 1, dead 1, forgotten 1");
}

// Whatever is kept: it will not come back for it.
TEST(Links, AClientThatSaysGoodbyeIsForgottenAtOnce) {
  LinkOptions options;
  options.resume_for = std::chrono::seconds(10);
  Carried s(options);
  s.user.keeps = true;
  s.enter(1, "anna");
  s.lose(1, 1000, 1001);
  EXPECT_EQ(s.noticed(), "open 1, lost 1, dead 1");
  s.pass(1000);
  EXPECT_EQ(s.noticed(), "forgotten 1");
  EXPECT_TRUE(s.links.all().empty());
}

// A link that is present never gives way, and one of another identity only where all are too many.
TEST(Links, AtALimitTheOldestLostLinkGivesWay) {
  LinkOptions options;
  options.links_max = 4;
  options.identity_links_max = 2;
  Carried s(options);
  s.enter(1, "anna");
  s.enter(2, "bert");
  s.enter(3, "bert");
  s.lose(1, 100);
  s.noticed();
  s.enter(4, "bert", 200);
  EXPECT_EQ(s.asked(), "close 4 too_many_connections");
  s.lose(3, 300);
  s.enter(5, "bert", 400);
  EXPECT_EQ(s.noticed(), "lost 3, dead 3, forgotten 3, open 4");
  s.enter(6, "carl", 500);
  s.lose(6, 600);
  s.enter(7, "carl", 700);
  EXPECT_EQ(s.noticed(), "open 5, lost 5, dead 1, forgotten 1, open 6");
}

TEST(Links, AnAnswerToNoLoginLetsNobodyIn) {
  Carried s;
  s.judge(1, "anna");
  s.connect(1);
  s.judge(1, "anna");
  s.packet(1, hello());
  s.judge(1, "anna");
  EXPECT_EQ(s.noticed(), "");
  s.packet(1, login());
  s.judge(1, "anna");
  s.judge(1, "bert");  // once
  EXPECT_EQ(s.noticed(), "open 1");
  EXPECT_EQ(s.link(1).login.identity().name, "anna");
  EXPECT_EQ(s.links.all().size(), 1U);
}

TEST(Links, AWithdrawnLoginEndsItsLinksAndThoseThatMightReturn) {
  LinkOptions options;
  options.resume_for = std::chrono::seconds(10);
  Carried s(options);
  s.user.keeps = true;
  s.enter(1, "anna");
  s.enter(2, "anna");
  s.enter(3, "bert");
  s.lose(2, 100);
  s.noticed();
  s.withdraw_login("anna", 200);
  EXPECT_EQ(s.asked(), "close 1 revoked");
  s.pass(200);
  // The end of a link may take long: each has a step of its own.
  EXPECT_EQ(s.noticed(), "lost 1, dead 1, forgotten 1");
  EXPECT_EQ(s.links.deadline(), now_ms(200).steady);
  s.pass(200);
  EXPECT_EQ(s.noticed(), "dead 2, forgotten 2");
  ASSERT_EQ(s.links.all().size(), 1U);
  EXPECT_TRUE(s.link(3).open());
}

TEST(Links, AClientHasOneDialOrConnectionAtATime) {
  LinkOptions options;
  options.role = Role::kClient;
  Carried s(options);
  s.links.dial_if_due(now_ms(0));
  s.links.dial_if_due(now_ms(60'000));
  EXPECT_EQ(s.asked(), "dial 1");
  DialFailed other{{7}, {Cause::kNoAnswer, "late"}};
  s.links.on(other, now_ms(60'000));
  s.links.dial_if_due(now_ms(120'000));
  EXPECT_EQ(s.asked(), "");
  DialFailed failed{{1}, {Cause::kNoAnswer, "nobody answers"}};
  s.links.on(failed, now_ms(120'000));
  const auto again = s.links.deadline();
  ASSERT_TRUE(again);
  EXPECT_LE(*again, now_ms(120'500).steady);
  s.links.dial_if_due({*again, 0, 0});
  EXPECT_EQ(s.asked(), "dial 2");
  DialFailed second{{2}, {Cause::kNoAnswer, "nobody answers"}};
  s.links.on(second, now_ms(121'000));
  s.links.stop(now_ms(121'000));
  s.links.dial_if_due(now_ms(200'000));
  EXPECT_EQ(s.asked(), "");
}

}  // namespace
}  // namespace connect_bridge::link_test
