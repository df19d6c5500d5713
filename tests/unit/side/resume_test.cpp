// A link that is lost and comes back, at the side that exports: what was published meanwhile, and
// what is never resumed.
#include <gtest/gtest.h>

#include "unit/flow/script.hpp"
#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

// What goes on leaves message by message, in less than a millisecond each.
std::string all_said(Script& s, std::uint32_t connection) {
  std::string lines;
  for (int i = 0; i < 10; ++i) {
    lines += s.said(connection);
    s.pass(1);
  }
  return lines;
}

// Link 1 demands /a of publisher 1 by subscription 2, and has got "a".
struct Exporting : Script {
  explicit Exporting(SideOptions options = keeping(), const Qos& q = qos())
      : Script(std::move(options)) {
    graph({topic("/a").pub(1, q)});
    session = join(1);
    say(1, Demand{{{{1}, 1, true}}});
    take(2, 1, "a");
    EXPECT_EQ(said(1), "1.1 a\n");
    acknowledge(1);
    did();
  }
  // The link is back, and has offered /a on channel 2.
  void come_back() {
    EXPECT_EQ(join(2, session), session);
    logged.clear();
  }
  Token128 session;
};

// Of the next message that is sent to the peer; 0: there is none.
std::uint32_t next_sequence(Script& s, std::uint32_t connection) {
  while (const auto packet = s.side.next_packet({connection}, {})) {
    if (packet->text) continue;
    const Bytes bytes = flow_test::joined(*packet);
    FrameReader reader(bytes);
    for (auto frame = reader.next(); frame && frame.value(); frame = reader.next())
      if (const auto* message = std::get_if<MessageFrame>(&*frame.value()))
        return message->sequence;
  }
  return 0;
}

TEST(SideResume, WhatABreakLosesComesLaterAndOnce) {
  Exporting s;
  s.take(2, 1, "b");
  EXPECT_EQ(s.said(1), "1.1 b\n");  // it may have arrived or not
  s.take(2, 1, "c");                // never sent
  s.lose(1);
  s.pass(10'000);  // the link is dead
  s.take(2, 1, "d");
  EXPECT_EQ(s.did(), "");  // still subscribed
  EXPECT_EQ(s.status().links.at(0).topics.at(0).queued, 3U);
  s.come_back();
  s.take(2, 1, "e");
  EXPECT_EQ(s.said(2), "");  // not demanded yet
  s.say(2, Demand{{{{2}, 1, true, 2}}});
  s.take(2, 1, "f");
  EXPECT_EQ(all_said(s, 2), "2.1 c\n2.1 d\n2.1 e\n2.1 f\n");
  EXPECT_EQ(s.status().links.at(0).topics.at(0).messages, 6U);
  EXPECT_EQ(s.status().links.at(0).topics.at(0).dropped.total(), 0U);
  s.did();
  EXPECT_NE(s.logged.find("3 messages come late, 0 are lost"), std::string::npos) << s.logged;
}

TEST(SideResume, NumbersRiseAlsoWhereNothingIsLeft) {
  Exporting s;
  s.lose(1);
  s.pass(59'900);
  s.come_back();
  s.pass(200);  // what was kept is over
  s.say(2, Demand{{{{2}, 1, true, 7}}});
  s.take(3, 1, "b");
  EXPECT_EQ(next_sequence(s, 2), 8U);
}

TEST(SideResume, NothingIsKeptWithoutTheImportersWish) {
  Exporting s;
  s.demand(1, 1, false);
  s.demand(1, 1);
  s.did();
  s.lose(1);
  EXPECT_EQ(s.did(), "unsubscribe 3\n");
}

TEST(SideResume, CommandsAreNeverReplayed) {
  Treatment urgent;
  urgent.priority = Priority::kUrgent;
  Treatment aged;
  aged.max_age = std::chrono::seconds(1);
  Treatment refused;
  refused.resume = false;
  for (const auto& treatment : {urgent, aged, refused}) {
    Exporting s(keeping(treatment));
    s.lose(1);
    EXPECT_EQ(s.did(), "unsubscribe 2\n");
  }
  Treatment high;  // it is a command for all that
  high.priority = Priority::kHigh;
  EXPECT_FALSE(resumes(high, "/cmd_vel", "geometry_msgs/msg/Twist"));
  urgent.resume = true;
  Exporting s(keeping(urgent));
  s.lose(1);
  EXPECT_EQ(s.did(), "");
}

// A server that has forgotten the session does not know what it had of it: what a later connection
// of the new one resumes is not of the old one.
TEST(SideResume, ANewSessionResumesNothing) {
  for (const bool kept : {true, false}) {
    auto options = client();
    options.resume_for = std::chrono::seconds(60);
    Script s(std::move(options));
    s.graph({topic("/a").pub(1)});
    s.pass(1000);
    s.be_welcomed(1);
    s.say(1, Accepts{{{{"/**"}, {}}}, {}});
    s.said(1);
    s.say(1, Demand{{{{1}, 1, true}}});
    s.take(2, 1, "b");
    s.lose(1);
    s.pass(500);
    s.be_welcomed(2, 0, Script::peer_id(kept ? 77 : 78));
    s.did();
    EXPECT_EQ(s.logged.find("0 messages come late, 1 are lost") == std::string::npos, kept)
        << s.logged;
    s.say(2, Accepts{{{{"/**"}, {}}}, {}});
    s.lose(2);
    s.pass(1000);
    s.be_welcomed(3, 0, Script::peer_id(kept ? 77 : 78));
    s.say(3, Accepts{{{{"/**"}, {}}}, {}});
    all_said(s, 3);
    s.say(3, Demand{{{{3}, 1, true, 0}}});
    EXPECT_EQ(all_said(s, 3), kept ? "3.1 b\n" : "");
  }
}

TEST(SideResume, BestEffortIsNotKept) {
  Exporting s(keeping(), best_effort());
  s.lose(1);
  s.take(2, 1, "b");
  s.come_back();
  s.say(2, Demand{{{{2}, 1, true, 1}}});
  s.take(3, 1, "c");
  EXPECT_EQ(s.said(2), "2.1 c\n");
}

// A publisher that joins makes the subscription, which another link wants, best effort.
TEST(SideResume, WhatCannotBeKeptIsCounted) {
  Exporting s;
  s.join(3);
  s.say(3, Demand{{{{1}, 1, true}}});
  s.lose(1);
  s.graph({topic("/a").pub(1, qos()).pub(2, best_effort())});
  EXPECT_EQ(s.did().substr(0, 26), "unsubscribe 2\nsubscribe 3 ");
  s.take(3, 1, "b");
  s.take(3, 2, "c");  // nobody promised it
  const DropCounts dropped = s.status().links.at(0).topics.at(0).dropped;
  EXPECT_EQ(dropped.by_reason[static_cast<std::size_t>(DropReason::kResumeBound)], 1U);
}

TEST(SideResume, TheTimeToKeepHasAnEnd) {
  Exporting s;
  s.lose(1);
  s.take(2, 1, "b");
  s.pass(59'999);
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.status().links.size(), 1U);
  s.pass(1);
  EXPECT_EQ(s.did(), "unsubscribe 2\n");
  EXPECT_EQ(s.status().links.size(), 0U);
  EXPECT_NE(s.logged.find("0 messages come late, 1 are lost"), std::string::npos) << s.logged;
}

TEST(SideResume, AnotherProcessAtTheOtherEndGetsNothing) {
  Exporting s;
  s.lose(1);
  s.take(2, 1, "b");
  s.give(ConnectionOpened{{2}, "10.0.0.2"});
  s.binary(2, encode(Hello{1, 1, Script::peer_id(9), s.session, "/peer"}));
  s.binary(2, encode(Login{"none", {}}));
  s.give(Authenticated{{2}, Identity{}, ""});
  s.did();
  EXPECT_NE(s.logged.find("it was started again"), std::string::npos) << s.logged;
  EXPECT_TRUE(s.status().links.at(0).topics.empty());
}

TEST(SideResume, RulesThatForbidItEndWhatIsKept) {
  Exporting s;
  s.lose(1);
  s.give(PolicyChanged{Policy{std::vector<Rule>{}}});
  EXPECT_EQ(s.did(), "unsubscribe 2\n");
}

TEST(SideResume, OtherRulesLeaveWhatIsKept) {
  Exporting s;
  s.lose(1);
  s.take(2, 1, "b");
  s.give(PolicyChanged{Policy({rule({"/b"}, {}), everything()})});
  EXPECT_EQ(s.did(), "");
  s.take(2, 1, "c");
  s.come_back();
  s.say(2, Demand{{{{2}, 1, true, 1}}});
  EXPECT_EQ(all_said(s, 2), "2.1 b\n2.1 c\n");
}

// A token that somebody else renews is an everyday matter.
TEST(SideResume, AChangeOfAnotherIdentityLeavesWhatIsKept) {
  Exporting s;
  s.lose(1);
  s.take(2, 1, "b");
  s.login(3, {}, Identity{"bert", {}, 0, "token:3"});
  s.give(IdentitiesChanged{{{"token:3", Identity{"bert", {"crew"}, 0, "token:3"}}}});
  s.come_back();
  s.say(2, Demand{{{{2}, 1, true, 1}}});
  EXPECT_EQ(s.said(2), "2.1 b\n");
}

// What is kept ends with its link, also where nothing came and nobody publishes any longer.
TEST(SideResume, ATopicWithoutPublishersStaysForWhatItCounts) {
  Exporting s;
  s.lose(1);
  s.graph({});
  s.pass(1000);
  EXPECT_EQ(s.did(), "unsubscribe 2\n");
  s.pass(60'000);
  EXPECT_EQ(s.status().links.size(), 0U);
}

TEST(SideResume, APublisherThatEndedMeanwhileIsStillHeard) {
  Exporting s;
  s.lose(1);
  s.take(2, 1, "b");
  s.graph({});
  s.pass(20'000);
  s.come_back();
  s.say(2, Demand{{{{2}, 1, true, 1}}});
  EXPECT_EQ(s.said(2), "2.1 b\n");
  s.acknowledge(2);
  s.pass(1000);
  EXPECT_EQ(s.did(), "unsubscribe 2\n");
}

}  // namespace
}  // namespace connect_bridge::side_test
