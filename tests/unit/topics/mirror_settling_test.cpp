// When a mirror may ask for data.
#include "core/topics/mirror_settling.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <set>
#include <string>

#include "unit/topics/importing.hpp"

namespace connect_bridge::topics_test {
namespace {

// Of a mirror of publisher 7.
struct Settles : Importing {
  explicit Settles(const std::string& name = "/a") : topic{name, kType} {}

  void begin(std::int64_t at = 0, std::int64_t least_ms = 0) {
    subject.begin({1}, std::chrono::milliseconds(least_ms), ms(at));
    context.claim_changed = false;
  }
  void meet_bridge() { graph = picture({side_test::topic(kClaimsTopic).pub(9, {}, "bridge")}); }
  // A bridge may be in this graph, as a peer says.
  void expect_bridge() {
    context.graph_since = ms(0).steady;
    Token128 neighbour;
    neighbour.bytes.fill(9);
    claims.expect({1}, {neighbour});
  }
  void hear_bridge() {
    Claim claim;
    claim.side.bytes.fill(9);
    claims.update(gid(9), claim, ms(0).steady);
  }

  TopicKey topic;
  Gid publisher = gid(7);
  Mirror mirror{context, {topic, publisher}};  // its deadlines are not handled here
  MirrorSettling subject{context, mirror, topic, publisher};
};

TEST(MirrorSettling, AloneItSettlesAtOnce) {
  Settles s;
  s.begin();
  EXPECT_TRUE(s.subject.settled(ms(0)));
  EXPECT_TRUE(s.subject.feeds());
  EXPECT_FALSE(s.context.timers.deadline());
}

TEST(MirrorSettling, NotBeforeTheGraphIsDiscovered) {
  Settles s;
  s.context.graph_since = ms(0).steady;
  s.begin();
  EXPECT_FALSE(s.subject.settled(ms(499)));
  EXPECT_FALSE(s.subject.on_time(ms(499)));
  EXPECT_FALSE(s.subject.feeds());
  EXPECT_TRUE(s.subject.on_time(ms(500)));
  EXPECT_TRUE(s.subject.feeds());
  EXPECT_TRUE(s.context.claim_changed);
  EXPECT_FALSE(s.subject.on_time(ms(501)));  // once
}

TEST(MirrorSettling, NotBeforeTheLeastTime) {
  Settles s;
  s.begin(0, 300);
  EXPECT_FALSE(s.subject.settled(ms(299)));
  EXPECT_TRUE(s.subject.settled(ms(300)));
}

TEST(MirrorSettling, BesideAnotherBridgeItWaitsForClaims) {
  Settles s;
  s.meet_bridge();
  s.begin();
  EXPECT_FALSE(s.subject.settled(ms(249)));
  EXPECT_FALSE(s.subject.feeds());
  EXPECT_TRUE(s.subject.on_time(ms(250)));
}

TEST(MirrorSettling, AfterAChangeItAsksForNothingForAMoment) {
  Settles s;
  s.begin();
  s.subject.again(ms(1000));
  EXPECT_FALSE(s.subject.settled(ms(1249)));
  EXPECT_TRUE(s.subject.feeds());  // it has settled since it was made
  s.subject.again(ms(1100));
  EXPECT_FALSE(s.subject.settled(ms(1349)));
  EXPECT_TRUE(s.subject.settled(ms(1350)));
}

TEST(MirrorSettling, AChangeMakesItNoEarlier) {
  Settles s;
  s.begin(0, 5000);
  s.subject.again(ms(0));
  EXPECT_FALSE(s.subject.settled(ms(4999)));
}

TEST(MirrorSettling, ItsEndEndsTheWait) {
  Settles s;
  s.begin(0, 300);
  EXPECT_TRUE(s.context.timers.deadline());
  s.subject.end();
  EXPECT_FALSE(s.context.timers.deadline());
  EXPECT_FALSE(s.subject.feeds());
}

TEST(MirrorSettling, TheServicesOfItsActionAreTold) {
  const std::set<std::string> action = {"/go"};
  Settles s("/go/_action/feedback");
  s.begin(0, 300);
  EXPECT_EQ(s.action_topics.take_changes(), action);
  s.subject.on_time(ms(300));
  EXPECT_EQ(s.action_topics.take_changes(), action);
  s.subject.end();
  EXPECT_EQ(s.action_topics.take_changes(), action);
}

// ---- a bridge that may be in this graph

TEST(MirrorSettling, ABridgeThatIsNotHeardIsWaitedForLonger) {
  Settles s;
  s.expect_bridge();
  s.begin();
  EXPECT_TRUE(s.subject.released());
  EXPECT_FALSE(s.subject.settled(ms(3499)));
  EXPECT_TRUE(s.subject.on_time(ms(3500)));
  EXPECT_FALSE(s.subject.released());
  EXPECT_TRUE(s.subject.feeds());
}

TEST(MirrorSettling, WhenNobodyIsWaitedForItSettlesAtOnce) {
  Settles s;
  s.expect_bridge();
  s.begin();
  s.claims.expect_nobody();
  s.subject.on_claims(ms(1000));
  EXPECT_TRUE(s.subject.settled(ms(1000)));
  EXPECT_FALSE(s.subject.released());
  EXPECT_TRUE(s.context.claim_changed);
}

// Two that settle together would both feed until their claims have crossed.
TEST(MirrorSettling, ABridgeThatIsHeardAtLastIsGivenTimeToClaim) {
  Settles s;
  s.expect_bridge();
  s.begin();
  s.hear_bridge();
  s.subject.on_claims(ms(1000));
  EXPECT_FALSE(s.subject.released());
  EXPECT_FALSE(s.subject.settled(ms(1249)));
  EXPECT_TRUE(s.subject.on_time(ms(1250)));
}

TEST(MirrorSettling, ABridgeThatIsSeenButNotHeardIsGivenTimeToClaim) {
  Settles s;
  s.expect_bridge();
  s.meet_bridge();
  s.begin();
  EXPECT_FALSE(s.subject.on_time(ms(3500)));
  EXPECT_FALSE(s.subject.released());
  EXPECT_TRUE(s.context.claim_changed);
  EXPECT_FALSE(s.subject.settled(ms(3749)));
  EXPECT_TRUE(s.subject.on_time(ms(3750)));
}

// ---- its link is lost

// A mirror beside another bridge that has fed, until its link was lost after a second.
struct Released : Settles {
  Released() {
    meet_bridge();
    begin();
    EXPECT_TRUE(subject.on_time(ms(250)));
    context.claim_changed = false;
    subject.release(true, ms(1000));
    EXPECT_TRUE(subject.released());
    EXPECT_FALSE(subject.feeds());
    EXPECT_TRUE(context.claim_changed);
  }
};

TEST(MirrorSettling, AnotherBridgeHasTimeToTakeOver) {
  Released s;
  s.subject.release(false, ms(1100));
  EXPECT_FALSE(s.subject.released());
  EXPECT_FALSE(s.subject.settled(ms(1249)));
  EXPECT_TRUE(s.subject.on_time(ms(1250)));
}

TEST(MirrorSettling, WhenNoneHasTakenOverItFeedsAtOnce) {
  Released s;
  s.subject.release(false, ms(2000));
  EXPECT_TRUE(s.subject.settled(ms(2000)));
  EXPECT_TRUE(s.subject.feeds());
}

TEST(MirrorSettling, WhenOneHasTakenOverItSettlesAgain) {
  Released s;
  Claim claim;
  claim.side.bytes.fill(9);
  claim.origins = {{s.publisher, true}};
  s.claims.update(gid(9), claim, ms(1100).steady);
  s.subject.release(false, ms(2000));
  EXPECT_FALSE(s.subject.settled(ms(2249)));
  EXPECT_TRUE(s.subject.settled(ms(2250)));
}

TEST(MirrorSettling, OneThatHasNotFedSettlesAgainHoweverLongItsLinkWasLost) {
  Settles s;
  s.meet_bridge();
  s.begin();
  s.subject.release(true, ms(100));
  s.subject.release(false, ms(2000));
  EXPECT_FALSE(s.subject.settled(ms(2249)));
  EXPECT_TRUE(s.subject.settled(ms(2250)));
}

TEST(MirrorSettling, AloneItKeepsItsClaim) {
  Settles s;
  s.begin();
  s.subject.release(true, ms(1000));
  EXPECT_FALSE(s.subject.released());
  EXPECT_TRUE(s.subject.feeds());
}

// They stay with its services, and these with their calls.
TEST(MirrorSettling, TopicsOfAnActionKeepTheirClaim) {
  Settles s("/go/_action/feedback");
  s.meet_bridge();
  s.begin();
  s.subject.on_time(ms(250));
  s.subject.release(true, ms(1000));
  EXPECT_FALSE(s.subject.released());
  EXPECT_TRUE(s.subject.feeds());
}

}  // namespace
}  // namespace connect_bridge::topics_test
