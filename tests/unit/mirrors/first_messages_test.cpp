// Messages for a mirror that no subscriber can receive yet.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

using std::chrono::milliseconds;

// Link 1 offers /a of publisher 7, which a subscriber here wants; mirrors wait for 60 ms.
struct Listening : Script {
  explicit Listening(const Qos& settings = qos(), Duration max_age = kForever)
      : Script(waiting(max_age)) {
    graph({topic("/a").sub(5, settings)});
    pass(1000);
    be_welcomed(1);
    did();
    say(1, Offer{{channel(1, "/a", {origin(1, 7, settings)})}, true});
    said(1);
  }
  static SideOptions waiting(Duration max_age) {
    Rule all = everything();
    all.treatment.max_age = max_age;
    auto options = client({all});
    options.matching = milliseconds(60);
    return options;
  }
  // From now on the age of messages is known.
  void tell_clock() {
    give(TimePassed{});  // it asks
    const Stamp now = flow_test::at_ms(at);
    Bytes reply;
    append_header(TimeReply{now, now, now, 0}, reply);
    binary(1, reply);
  }
};

TEST(MirrorOfAFirstMessage, WaitsUntilTheSubscribersHaveFoundIt) {
  Listening s;
  s.message(1, 1, 1, "first");
  s.message(1, 1, 1, "second");
  EXPECT_EQ(s.did(), "mirror 2 /a reliable volatile 10\nclaim [7]\n");
  s.pass(60);
  EXPECT_EQ(s.did(), "publish 2 first\npublish 2 second\n");
  s.message(1, 1, 1, "third");
  EXPECT_EQ(s.did(), "publish 2 third\n");
}

// The middleware keeps them for who comes late: none is displaced by those behind it.
TEST(MirrorOfAFirstMessage, OfALatchedTopicAllArePublished) {
  Listening s(latched(200));
  s.did();
  for (int i = 1; i <= 103; ++i) s.message(1, 1, 1, "m" + std::to_string(i));
  s.pass(60);
  EXPECT_EQ(s.dropped(DropReason::kQueueDepth), 0U);
  const std::string did = s.did();
  EXPECT_EQ(did.substr(0, 13), "publish 2 m1\n");
  EXPECT_EQ(std::count(did.begin(), did.end(), '\n'), 103);
}

TEST(MirrorOfAFirstMessage, WaitsAlsoUnderARuleWithAMaxAge) {
  Listening s(qos(), milliseconds(300));
  s.message(1, 1, 1, "first");
  EXPECT_EQ(s.did(), "mirror 2 /a reliable volatile 10\nclaim [7]\n");
  s.pass(60);
  EXPECT_EQ(s.did(), "publish 2 first\n");
}

// It is 10 ms old and may become 30: it leaves while it is fresh, and what came before it too.
TEST(MirrorOfAFirstMessage, WaitsNoLongerThanItIsFresh) {
  Listening s(qos(), milliseconds(30));
  s.tell_clock();
  s.did();
  s.message(1, 1, 1, "newer");
  s.message(1, 1, 1, "older", s.at - 10);
  s.message(1, 1, 1, "too old", s.at - 31);
  EXPECT_EQ(s.dropped(DropReason::kMaxAge), 1U);
  s.pass(10);
  s.message(1, 1, 1, "next");
  EXPECT_EQ(s.did(), "");
  s.pass(10);
  EXPECT_EQ(s.did(), "publish 2 newer\npublish 2 older\n");
  s.pass(10);
  EXPECT_EQ(s.did(), "");
  s.pass(10);
  EXPECT_EQ(s.did(), "publish 2 next\n");
  EXPECT_EQ(s.dropped(DropReason::kMaxAge), 1U);
}

// The same, but the mirror waits for the name of its origin's node.
struct Unnamed : Script {
  explicit Unnamed(SideOptions options, std::vector<OriginOffer> others = {})
      : Script(as_nodes(std::move(options))) {
    graph({topic("/a").sub(5)});
    pass(1000);
    be_welcomed(1);
    OriginOffer unnamed = origin(1, 7);
    unnamed.node.clear();
    others.insert(others.begin(), unnamed);
    say(1, Offer{{channel(1, "/a", std::move(others))}, true});
    said(1);
    message(1, 1, 1, "first");
  }
  static SideOptions as_nodes(SideOptions options) {
    options.proxy_nodes = true;
    return options;
  }
};

// A loop that comes to it a little after its time must not find it too old.
TEST(MirrorOfAFirstMessage, LeavesSomeMillisecondsBeforeItIsTooOld) {
  Listening s(qos(), milliseconds(30));
  s.did();
  s.message(1, 1, 1, "first");
  s.at += 29;
  s.give(TimePassed{});
  EXPECT_EQ(s.did(), "publish 2 first\n");
  s.message(1, 1, 1, "second");
  s.at += 31;  // the loop stood still
  s.give(TimePassed{});
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.dropped(DropReason::kMaxAge), 1U);
}

TEST(MirrorOfAFirstMessage, IsLostWhereThePublisherIsMadeTooLate) {
  Unnamed s(Listening::waiting(milliseconds(300)), {origin(2, 8)});  // which is demanded
  s.did();
  s.pass(2000);
  EXPECT_EQ(s.did(), "mirror 3 /a reliable volatile 10\n");
  EXPECT_EQ(s.dropped(DropReason::kMaxAge), 1U);
}

// It waits for its node's name, and another bridge is there first.
TEST(MirrorOfAFirstMessage, IsDroppedWhereTheMirrorMayNotExistAnyMore) {
  Unnamed s(client());
  s.graph({topic("/a").sub(5).pub(7)});  // both ends are in one graph
  EXPECT_EQ(s.dropped(DropReason::kNoDemand), 1U);
  s.graph({topic("/a").sub(5)});
  s.pass(3000);
  EXPECT_EQ(s.did().find("publish"), std::string::npos);
}

TEST(MirrorOfAFirstMessage, TheNewestHundredWaitAndTheRestIsCounted) {
  Listening s;
  for (int i = 1; i <= 103; ++i) s.message(1, 1, 1, "m" + std::to_string(i));
  EXPECT_EQ(s.dropped(DropReason::kQueueDepth), 3U);
  s.did();
  s.pass(60);
  EXPECT_EQ(s.did().substr(0, 13), "publish 2 m4\n");
}

// A command from before a break is not executed after it.
TEST(MirrorOfAFirstMessage, ThatMustNotBeLateDoesNotWaitBeyondABreak) {
  Listening s(qos(), milliseconds(300));
  s.message(1, 1, 1, "first");
  s.did();
  s.lose(1);
  s.pass(60);
  EXPECT_EQ(s.did().find("publish"), std::string::npos);
}

TEST(MirrorOfAFirstMessage, ThatMayBeLateIsPublishedInABreak) {
  Listening s;
  s.message(1, 1, 1, "first");
  s.did();
  s.lose(1);
  s.pass(60);
  EXPECT_NE(s.did().find("publish 2 first\n"), std::string::npos);
}

// It may have come in a packet of a megabyte, of which nobody would know.
TEST(MirrorOfAFirstMessage, DoesNotKeepItsPacket) {
  Listening s;
  const Payload body = sample("first");
  MessageFrame frame;
  frame.channel = {1};
  frame.subject = {1};
  frame.sequence = 1;
  frame.demand = 1;
  frame.raw_bytes = frame.body_bytes = static_cast<std::uint32_t>(body.size());
  frame.part = body.view();
  auto packet = std::make_shared<Bytes>();
  append_header(frame, *packet);
  packet->insert(packet->end(), body.view().begin(), body.view().end());
  const std::weak_ptr<Bytes> kept = packet;
  const ByteView view{*packet};
  s.give(PacketReceived{{1}, false, Payload::wrap(std::move(packet), view)});
  s.did();
  EXPECT_TRUE(kept.expired());
  s.pass(60);
  EXPECT_EQ(s.did(), "publish 2 first\n");
}

TEST(MirrorOfAFirstMessage, IsNotPublishedUnderOtherRules) {
  Listening s;
  s.message(1, 1, 1, "first");
  s.give(PolicyChanged{Policy({rule({}, {})})});
  s.pass(60);
  EXPECT_EQ(s.did().find("publish"), std::string::npos);
}

// A rule of something else has changed.
TEST(MirrorOfAFirstMessage, IsPublishedWhereTheRulesSayTheSameOfIt) {
  Listening s(latched(5));
  s.message(1, 1, 1, "first");
  s.give(PolicyChanged{Policy({rule({"/other"}, {"/**"})})});
  s.pass(60);
  EXPECT_NE(s.did().find("publish 2 first\n"), std::string::npos);
  EXPECT_EQ(s.dropped(DropReason::kNoDemand), 0U);
}

// Its rule has another rate now: what came under the old one is asked for again.
TEST(MirrorOfAFirstMessage, ComesAgainWhereItsRuleIsAnother) {
  Listening s(latched(5));
  s.message(1, 1, 1, "first");
  Rule slow = rule({}, {"/**"});
  slow.treatment.max_rate = 10;
  s.did();
  s.said(1);
  s.give(PolicyChanged{Policy({slow})});
  EXPECT_EQ(s.did().find("publish"), std::string::npos);
  EXPECT_NE(s.said(1).find("demand"), std::string::npos);
}

}  // namespace
}  // namespace connect_bridge::side_test
