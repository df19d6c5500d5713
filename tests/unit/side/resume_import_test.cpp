// A link that is lost and comes back, at the side that imports: what it asks for.
#include <gtest/gtest.h>

#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

// Link 1 offers /a of publisher 11, demanded by a local subscriber through mirror 2.
struct Importing : Script {
  explicit Importing(SideOptions options = keeping(), const Qos& listener = qos(),
                     const Qos& origin_qos = qos())
      : Script(std::move(options)), told(origin_qos) {
    graph({topic("/a").sub(1, listener)});
    pass(1000);
    session = join(1);
    say(1, Offer{{channel(1, "/a", {origin(1, 11, told)})}, true});
    did();
  }
  // The link is back, and the peer has kept what came meanwhile.
  std::string come_back(bool kept = true) {
    EXPECT_EQ(join(2, session), session);
    auto offered = channel(5, "/a", {origin(3, 11, told)});
    offered.resume = kept;
    say(2, Offer{{offered}, true});
    return said(2);
  }
  Qos told;
  Token128 session;
};

TEST(SideResume, AMirrorIsMadeAnewAndGoesOnBehindWhatArrived) {
  Importing s;
  EXPECT_EQ(s.said(1), "demand 1 on resume\n");
  s.message(1, 1, 1, "a");  // sequences 1, 2
  s.message(1, 1, 1, "b");
  EXPECT_EQ(s.did(), "publish 2 a\npublish 2 b\n");
  s.lose(1);
  s.pass(30'000);
  EXPECT_EQ(s.did(), "unmirror 2\nclaim []\n");
  EXPECT_EQ(s.come_back(), "");  // its subscribers have to find it
  EXPECT_EQ(s.did(), "mirror 3 /a reliable volatile 10\nclaim [11]\n");
  s.pass(199);
  EXPECT_EQ(s.said(2), "");
  s.pass(1);
  EXPECT_EQ(s.said(2), "demand 5 on resume after 2\n");
  s.message(2, 5, 3, "c");
  EXPECT_EQ(s.did(), "publish 3 c\n");
}

// Whatever the other end would do: nothing that is older than the break moves a robot, unless its
// own rule says so.
TEST(SideResume, ARobotAsksForNothingThatWasLost) {
  for (const bool resume : {false, true}) {
    Rule rule = everything();
    if (resume) rule.treatment.resume = true;
    SideOptions options = server({rule});
    options.resumes_imported = false;
    options.resume_for = std::chrono::seconds(60);
    Script s(options);
    s.graph({topic("/a").sub(1)});
    s.pass(1000);
    s.join(1);
    s.say(1, Offer{{channel(1, "/a", {origin(1, 11)})}, true});
    EXPECT_EQ(s.said(1), std::string("demand 1 on") + (resume ? " resume" : "") + "\n");
  }
}

TEST(SideResume, AShortBreakLeavesTheMirrorAndNothingWaits) {
  Importing s;
  s.message(1, 1, 1, "a");
  s.message(1, 1, 1, "b");
  s.lose(1);
  EXPECT_EQ(s.come_back(), "demand 5 on resume after 2\n");
  s.message(2, 5, 3, "c");
  // A further break before anything arrived, or after it.
  s.lose(2);
  EXPECT_EQ(s.join(3, s.session), s.session);
  auto offered = channel(6, "/a", {origin(3, 11)});
  offered.resume = true;
  s.say(3, Offer{{offered}, true});
  EXPECT_EQ(s.said(3), "demand 6 on resume after 3\n");
  s.lose(3);
  EXPECT_EQ(s.join(4, s.session), s.session);
  s.say(4, Offer{{offered}, true});
  EXPECT_EQ(s.said(4), "demand 6 on resume after 3\n");
}

// Its demands may all have been lost: "behind 0" would bring what it had declined.
TEST(SideResume, WhatWasDeclinedDoesNotComeAfterASecondDemand) {
  Qos best_effort = qos();
  best_effort.reliability = Reliability::kBestEffort;
  Importing s(keeping(), best_effort);
  s.message(1, 1, 1, "a");
  s.lose(1);
  EXPECT_EQ(s.come_back(), "demand 5 on resume\n");
  s.graph({topic("/a")});
  s.graph({topic("/a").sub(1)});
  s.did();
  EXPECT_EQ(s.said(2), "demand 5 off\ndemand 5 on resume\n");
  s.lose(2);
  EXPECT_EQ(s.join(3, s.session), s.session);
  auto offered = channel(6, "/a", {origin(3, 11)});
  offered.resume = true;
  s.say(3, Offer{{offered}, true});
  s.pass(1000);
  EXPECT_EQ(s.said(3), "demand 6 on resume\n");
}

TEST(SideResume, AFurtherBreakWhileTheMirrorSettlesChangesNothing) {
  Importing s;
  s.message(1, 1, 1, "a");
  s.lose(1);
  s.pass(30'000);
  EXPECT_EQ(s.come_back(), "");
  s.pass(100);
  s.lose(2);
  EXPECT_EQ(s.join(3, s.session), s.session);
  auto offered = channel(6, "/a", {origin(3, 11)});
  offered.resume = true;
  s.say(3, Offer{{offered}, true});
  s.pass(400);
  EXPECT_EQ(s.said(3), "demand 6 on resume after 1\n");
}

TEST(SideResume, APeerThatKeptNothingIsAskedForNothing) {
  Importing s;
  s.message(1, 1, 1, "a");
  s.lose(1);
  EXPECT_EQ(s.come_back(false), "demand 5 on resume\n");
}

TEST(SideResume, WhatArrivedIsNotRememberedForEver) {
  Importing s;
  s.said(1);
  s.message(1, 1, 1, "a");
  s.lose(1);
  s.pass(59'999);
  EXPECT_EQ(s.status().links.size(), 1U);
  s.pass(1);
  EXPECT_EQ(s.status().links.size(), 0U);
}

TEST(SideResume, BestEffortSubscribersAreNotSentWhatIsLate) {
  Importing s(keeping(), best_effort());
  EXPECT_EQ(s.said(1), "demand 1 on resume\n");
  s.lose(1);
  EXPECT_EQ(s.come_back(), "demand 5 on resume\n");
  s.lose(2);
  s.pass(3000);
  EXPECT_EQ(s.status().links.size(), 0U);  // nothing to wait for
}

// What the peer kept came to the best-effort one before the break.
TEST(SideResume, WhatWasDeclinedIsNotAskedForByALaterDemand) {
  Importing s(keeping(), best_effort());
  s.message(1, 1, 1, "a");
  s.lose(1);
  s.graph({topic("/a").sub(1, best_effort()).sub(2)});
  EXPECT_EQ(s.come_back(), "demand 5 on resume\n");
  s.lose(2);
  EXPECT_EQ(s.join(3, s.session), s.session);
  auto offered = channel(6, "/a", {origin(3, 11)});
  offered.resume = true;  // the demand has not arrived
  s.say(3, Offer{{offered}, true});
  EXPECT_EQ(s.said(3), "demand 6 on resume\n");
}

TEST(SideResume, WhatAnotherBridgeMirrorsMeanwhileDoesNotComeLate) {
  Importing s;
  s.message(1, 1, 1, "a");
  s.graph({topic(kClaimsTopic).pub(9, {}, "bridge"), topic("/a").sub(1)});
  s.said(1);
  s.lose(1);
  s.pass(30'000);
  s.claim(9, 5, {gid(11)});
  s.claim(9, 5, {});
  EXPECT_EQ(s.come_back(), "");
  s.pass(1000);
  EXPECT_EQ(s.said(2), "demand 5 on resume\n");
}

// Such as the client of another robot.
TEST(SideResume, ABridgeThatDoesNotMirrorItChangesNothing) {
  Importing s;
  s.said(1);
  s.message(1, 1, 1, "a");
  s.graph({topic(kClaimsTopic).pub(9, {}, "bridge"), topic("/a").sub(1)});
  s.claim(9, 5, {gid(12)});
  s.lose(1);
  s.pass(30'000);
  EXPECT_EQ(s.come_back(), "");
  s.pass(450);
  EXPECT_EQ(s.said(2), "demand 5 on resume after 1\n");
}

TEST(SideResume, TheImportersRuleMayRefuseIt) {
  Treatment aged;
  aged.max_age = std::chrono::seconds(1);
  Importing s(keeping(aged));
  EXPECT_EQ(s.said(1), "demand 1 on\n");
}

TEST(SideResume, WhatWaitsForAWorkerIsPublishedWhenTheConnectionIsLost) {
  auto options = keeping();
  options.compress_job_bytes = 10;
  Importing s(std::move(options));
  s.said(1);
  s.compressed(1, 1, 1, "a long sample, a long sample, a long sample");
  s.message(1, 1, 1, "b");
  s.did();
  s.lose(1);
  EXPECT_EQ(s.did(),
            "cancel 1\npublish 2 a long sample, a long sample, a long sample\npublish 2 b\n");
  EXPECT_EQ(s.come_back(), "demand 5 on resume after 2\n");
}

}  // namespace
}  // namespace connect_bridge::side_test
