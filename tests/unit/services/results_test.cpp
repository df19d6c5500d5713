// Results of goals after a break: docs/protocol.md section 9.7, rule 6.
#include <gtest/gtest.h>

#include <sstream>
#include <string>

#include "unit/services/calls_script.hpp"

namespace connect_bridge::side_test {
namespace {

ChannelOffer results(std::uint32_t channel, std::uint32_t epoch = 7) {
  ChannelOffer offer = service_channel(channel, "/go/_action/get_result", epoch);
  offer.type = "p/action/Go_GetResult";
  offer.action_type = "p/action/Go";
  return offer;
}

SideOptions with_actions(SideOptions options, Duration resume_for) {
  Rule rule = callable();
  rule.opens[Direction::kImport][OpenedBy::kActions] = {Pattern::parse("/**").value()};
  options.policy = Policy({rule});
  options.resume_for = resume_for;
  return options;
}

// The peer has call 1, for the result of a goal, whose request is 11 at mirror 1.
struct Awaiting : Script {
  explicit Awaiting(Duration resume_for = std::chrono::seconds(60))
      : Script(with_actions(server(), resume_for)) {
    graph({});
    pass(kDiscovered);
    session = join(1);
    say(1, Offer{{results(1)}, true});
    say(1, Attached{{1}, {1}, {0}, {}, "hash"});
    EXPECT_NE(did().find("mirror_service 1 /go/_action/get_result\n"), std::string::npos);
    request(*this, 11, "goal");
    said(1);
    acknowledge(1);
    lose(1);
  }
  // The same process is back and has forgotten the calls.
  void come_back(std::uint32_t epoch = 8, const std::string& hash = "hash") {
    EXPECT_EQ(join(2, session), session);
    say(2, Offer{{results(4, epoch)}, true});
    EXPECT_EQ(said(2), "attach 4 2\n");
    say(2, Attached{{4}, {2}, {0}, {}, hash});
  }
  std::string did_to_requests() {
    std::string done;
    std::istringstream lines(did());
    for (std::string line; std::getline(lines, line);)
      if (line.find("claim") == std::string::npos) done += line + "\n";
    return done;
  }
  [[nodiscard]] bool tells(const std::string& text) const {
    return logged.find(text) != std::string::npos;
  }

  Token128 session;
};

TEST(ResultsAfterABreak, ARequestForAResultIsMadeAgain) {
  Awaiting s;
  s.pass(10'000);  // the link is dead
  EXPECT_EQ(s.did_to_requests(), "");
  EXPECT_TRUE(s.tells("1 call(s) for results of goals wait for the return of"));
  s.come_back();
  EXPECT_EQ(s.said(2), "2.2 goal\n");
  s.message(2, 4, 2, "done");
  EXPECT_EQ(s.did_to_requests(), "respond 1.11 done\n");
  EXPECT_EQ(s.status().made_unanswered, 0U);
}

// Its dead_after may be longer than ours: it still has the calls.
TEST(ResultsAfterABreak, ThePeerForgetsTheCallsThatItStillHas) {
  Awaiting s;
  s.pass(10'000);
  EXPECT_EQ(s.join(2, s.session), s.session);
  s.say(2, Offer{{results(4)}, true});
  s.said(2);
  s.say(2, Attached{{4}, {2}, {1}, {{1}}, "hash"});
  EXPECT_EQ(s.said(2), "forget 4 1\n2.2 goal\n");
}

TEST(ResultsAfterABreak, ItOutlastsASecondBreak) {
  Awaiting s;
  s.pass(10'000);
  s.come_back();
  s.lose(2);
  s.pass(10'000);
  EXPECT_EQ(s.join(3, s.session), s.session);
  s.say(3, Offer{{results(1, 9)}, true});
  s.say(3, Attached{{1}, {3}, {0}, {}, "hash"});
  EXPECT_EQ(s.did_to_requests(), "");
  s.message(3, 1, 3, "done");
  EXPECT_EQ(s.did_to_requests(), "respond 1.11 done\n");
}

TEST(ResultsAfterABreak, AnUnknownGoalIsAborted) {
  Awaiting s;
  s.pass(10'000);
  s.come_back();
  s.did();
  s.message(2, 4, 2, Payload::adopt({0, 1, 0, 0, 0, 0, 0, 0}), Codec::kNone, 8);
  EXPECT_EQ(s.did_to_requests(), "abort_request 1.11\n");
  EXPECT_TRUE(s.tells("does not know the goal"));
  EXPECT_EQ(s.status().made_unanswered, 1U);
}

TEST(ResultsAfterABreak, ARefusedOneIsAborted) {
  Awaiting s;
  s.pass(10'000);
  s.come_back();
  s.did();
  s.say(2, Refuse{{4}, {{2}}, "limit", "too many"});
  EXPECT_EQ(s.did_to_requests(), "abort_request 1.11\n");
}

TEST(ResultsAfterABreak, WhenTheTimeIsOverTheGoalIsAborted) {
  Awaiting s;
  s.pass(59'000);
  EXPECT_EQ(s.did_to_requests(), "");
  s.pass(5'000);
  EXPECT_EQ(s.did_to_requests(), "abort_request 1.11\nunmirror_service 1\n");
  EXPECT_TRUE(s.tells("get no answer"));
  EXPECT_TRUE(s.tells("has not returned"));
  EXPECT_EQ(s.status().made_unanswered, 1U);
}

TEST(ResultsAfterABreak, WithoutTimeTheGoalIsAbortedWithTheLink) {
  Awaiting s(Duration::zero());
  s.pass(5'000);
  EXPECT_EQ(s.did_to_requests(), "abort_request 1.11\nunmirror_service 1\n");
  EXPECT_TRUE(s.tells("the link has ended"));
}

TEST(ResultsAfterABreak, MeanwhileNewRequestsAreRefused) {
  Awaiting s;
  s.pass(10'000);
  s.did();
  request(s, 12, "other");
  EXPECT_EQ(s.did_to_requests(), "abort_request 1.12\n");
  EXPECT_TRUE(s.tells("is lost"));
}

TEST(ResultsAfterABreak, WithItsLastCallerTheMirrorGoes) {
  Awaiting s;
  s.pass(10'000);
  s.did();
  s.give(CallersGone{{1}, {{11}}});
  EXPECT_EQ(s.did_to_requests(), "drop_request 1.11\nunmirror_service 1\n");
}

TEST(ResultsAfterABreak, AnotherProcessDoesNotKnowTheGoal) {
  Awaiting s;
  s.pass(10'000);
  s.did();
  s.join(2);  // another session and side; the first link may still return
  s.say(2, Offer{{results(1)}, true});
  s.say(2, Attached{{1}, {1}, {0}, {}, "hash"});
  EXPECT_EQ(s.said(2).find("goal"), std::string::npos);
}

TEST(ResultsAfterABreak, AnotherTypeHasAnotherMirror) {
  Awaiting s;
  s.pass(10'000);
  s.did();
  s.come_back(8, "other");
  EXPECT_EQ(s.did_to_requests(), "abort_request 1.11\nunmirror_service 1\n");
  EXPECT_EQ(s.said(2), "withdraw 2\nattach 4 3\n");
}

// A short break, after which the peer has forgotten: its dead_after is shorter than ours.
TEST(ResultsAfterABreak, AnotherEpochAsksAgain) {
  Awaiting s;
  s.pass(1'000);
  s.come_back();
  EXPECT_EQ(s.said(2), "2.2 goal\n");
  EXPECT_EQ(s.did_to_requests(), "");
}

TEST(ResultsAfterABreak, ABridgeThatHasTheGoalsGetsTheResults) {
  Awaiting s;
  s.pass(10'000);
  s.did();
  s.claim_service(9, 9, "/go/_action/send_goal");
  EXPECT_EQ(s.did_to_requests(), "abort_request 1.11\nunmirror_service 1\n");
}

}  // namespace
}  // namespace connect_bridge::side_test
