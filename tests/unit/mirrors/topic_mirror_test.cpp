#include "core/mirrors/topic_mirror.hpp"

#include <gtest/gtest.h>

#include "unit/mirrors/importing.hpp"

namespace connect_bridge::topics_test {
namespace {

// Two links that may offer the same origin, publisher 7.
struct MirrorScript : Importing {
  explicit MirrorScript(std::vector<Rule> rules = {everything()}) : Importing(std::move(rules)) {
    listen();
  }
  ~MirrorScript() { context.mirrors.all().clear(); }  // before the links, whose memory they hold
  std::string demanded() {
    one.send_demands();
    two.send_demands();
    return "1: " + first.said() + "2: " + second.said();
  }

  OneLink first{1}, second{2};
  LinkTopics one{context, first.link};
  LinkTopics two{context, second.link};
};

TEST(TopicMirror, IsFedByTheFirstLinkThatOffersIt) {
  MirrorScript s;
  s.offer(s.one, {origin(1, 7)});
  s.offer(s.two, {origin(1, 7)});
  EXPECT_EQ(s.did(), "mirror 1 /a reliable volatile 10\n");
  EXPECT_EQ(s.demanded(), "1: demand 1 on\n2: ");
  EXPECT_EQ(s.mirror(7).refusal(s.first.link), std::nullopt);
  EXPECT_EQ(s.mirror(7).refusal(s.second.link), DropReason::kDuplicate);
}

TEST(TopicMirror, AnotherLinkTakesOverWhenTheFirstIsLost) {
  MirrorScript s;
  s.offer(s.one, {origin(1, 7)});
  s.offer(s.two, {origin(1, 7)});
  s.demanded();
  s.did();
  s.lose(s.one);
  EXPECT_EQ(s.demanded(), "1: 2: demand 1 on\n");
  EXPECT_EQ(s.mirror(7).refusal(s.second.link), std::nullopt);
  EXPECT_EQ(s.did(), "");  // the publisher is the same
}

TEST(TopicMirror, WaitsForALinkThatIsLostAlone) {
  MirrorScript s;
  s.offer(s.one, {origin(1, 7)});
  s.did();
  s.lose(s.one);
  s.pass_to(10'000);
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.mirror(7).candidate({1})->offered, nullptr);
}

TEST(TopicMirror, AfterAChangeItAsksForNothingForAMoment) {
  MirrorScript s;
  s.offer(s.one, {origin(1, 7)});
  EXPECT_EQ(s.demanded(), "1: demand 1 on\n2: ");
  s.mirror(7).pause(ms(0));
  s.mirror(7).pause(ms(100));
  s.mirror(7).update(ms(100));
  EXPECT_EQ(s.demanded(), "1: demand 1 off\n2: ");
  s.pass_to(349);
  EXPECT_EQ(s.demanded(), "1: 2: ");
  s.pass_to(350);
  EXPECT_EQ(s.demanded(), "1: demand 1 on\n2: ");
}

TEST(TopicMirror, LingersWhenNobodyOffersIt) {
  MirrorScript s;
  s.offer(s.one, {origin(1, 7)});
  s.did();
  s.context.mirrors.remove_candidate(s.mirror(7), {1}, ms(0));
  EXPECT_EQ(s.context.mirrors.timers().deadline(), ms(200).steady);
  EXPECT_FALSE(s.mirror(7).is_over());
  s.pass_to(200);
  EXPECT_EQ(s.did(), "unmirror 1\n");
  EXPECT_TRUE(s.mirror(7).is_over());
}

TEST(TopicMirror, OfAnOriginThatIsHereThereIsNone) {
  MirrorScript s;
  s.graph = picture({topic("/a").pub(7).sub(50)});
  s.offer(s.one, {origin(1, 7)});
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.mirror(7).refusal(s.first.link), DropReason::kNoDemand);
}

TEST(TopicMirror, IsClaimedAndMadeWhenTheGraphIsDiscovered) {
  MirrorScript s;
  s.context.graph_since = ms(0).steady;
  s.offer(s.one, {origin(1, 7)});
  s.pass_to(499);
  EXPECT_FALSE(s.mirror(7).is_claimed());
  EXPECT_EQ(s.did(), "");
  s.pass_to(500);
  EXPECT_TRUE(s.mirror(7).is_claimed());
  EXPECT_EQ(s.did(), "mirror 1 /a reliable volatile 10\n");
  EXPECT_EQ(s.demanded(), "1: demand 1 on\n2: ");
}

TEST(TopicMirror, OfALatchedOriginPublishesNoSampleTwice) {
  MirrorScript s;
  s.offer(s.one, {origin(1, 7, latched())});
  EXPECT_EQ(s.mirror(7).publish(5, sample("five"), TimePoint::max(), ms(0)), std::nullopt);
  EXPECT_EQ(s.mirror(7).publish(5, sample("five"), TimePoint::max(), ms(0)),
            DropReason::kDuplicate);
  EXPECT_EQ(s.mirror(7).publish(4, sample("four"), TimePoint::max(), ms(0)),
            DropReason::kDuplicate);
  EXPECT_EQ(s.mirror(7).publish(6, sample("six"), TimePoint::max(), ms(0)), std::nullopt);
}

// A peer must not make the middleware keep everything, or monitor periods of a nanosecond.
TEST(TopicMirror, AsksNoMoreOfTheMiddlewareThanItCanBear) {
  MirrorScript s;
  Qos hungry = qos(5);
  hungry.history = History::kKeepAll;
  hungry.deadline = hungry.lifespan = hungry.liveliness_lease = Duration{1};
  s.offer(s.one, {origin(1, 7, hungry)});
  std::optional<CreateMirror> made;
  while (auto action = s.outputs.next())
    if (auto* mirror = std::get_if<CreateMirror>(&*action)) made = *mirror;
  ASSERT_TRUE(made);
  EXPECT_EQ(made->qos.history, History::kKeepLast);
  EXPECT_EQ(made->qos.depth, 1'000U);
  for (const Duration period : {made->qos.deadline, made->qos.lifespan, made->qos.liveliness_lease})
    EXPECT_EQ(period, std::chrono::milliseconds(1));
}

// Whoever listens next gets what is true then: the exporter sends the last samples.
TEST(TopicMirror, WhatItKeepsDoesNotGrowStaleWhileNobodyListens) {
  MirrorScript s;
  s.offer(s.one, {origin(1, 7, latched(1)), origin(2, 8, latched(1))});
  s.demanded();
  s.did();
  static_cast<void>(s.mirror(7).publish(1, sample("map"), TimePoint::max(), ms(0)));
  static_cast<void>(s.mirror(8).publish(1, sample("odom"), TimePoint::max(), ms(0)));
  s.mirror(7).update(ms(0));
  EXPECT_EQ(s.did(), "publish 1 map\npublish 2 odom\n");
  s.graph = picture({topic("/a")});
  s.mirror(7).update(ms(1));
  s.mirror(8).update(ms(1));
  EXPECT_EQ(s.did(),
            "unmirror 1\nmirror 3 /a reliable latched 1\n"
            "unmirror 2\nmirror 4 /a reliable latched 1\n");
  EXPECT_EQ(s.demanded(), "1: demand 1 off\n2: ");
  s.mirror(7).update(ms(2));
  EXPECT_EQ(s.did(), "");
  s.listen();
  s.mirror(7).update(ms(3));
  EXPECT_EQ(s.demanded(), "1: demand 1 on\n2: ");
  EXPECT_EQ(s.mirror(7).publish(1, sample("map"), TimePoint::max(), ms(4)), std::nullopt);
}

// A latched origin's sample was published, and its link was dead for a while.
struct AfterABreak : MirrorScript {
  AfterABreak() {
    offer(one, {origin(1, 7, latched(1))});
    static_cast<void>(mirror(7).publish(1, sample("order"), TimePoint::max(), ms(0)));
    lose(one);
    mirror(7).lose_link({1});
    context.mirrors.remove_candidate(mirror(7), {1}, ms(0));
    pass_to(1000);
    offer(one, {origin(1, 7, latched(1))}, 1000);
    demanded();
    did();
  }
  std::string with(const Topic& state, std::int64_t at) {
    graph = picture({state});
    mirror(7).update(ms(at));
    return did();
  }
};

TEST(TopicMirror, AfterABreakItIsMadeAgainForALateSubscriber) {
  AfterABreak s;
  EXPECT_EQ(s.mirror(7).publish(1, sample("order"), TimePoint::max(), ms(1000)),
            DropReason::kDuplicate);
  const std::string did = s.with(topic("/a").sub(50).sub(60, latched()), 1001);
  EXPECT_NE(did.find("unmirror"), std::string::npos) << did;
  EXPECT_EQ(s.mirror(7).publish(1, sample("order"), TimePoint::max(), ms(1002)), std::nullopt);
}

// The middleware sends it none of the samples that were published before.
TEST(TopicMirror, AVolatileSubscriberRepeatsNoOrder) {
  AfterABreak s;
  EXPECT_EQ(s.with(topic("/a").sub(50).sub(60), 1001), "");
  EXPECT_EQ(s.mirror(7).publish(1, sample("order"), TimePoint::max(), ms(1002)),
            DropReason::kDuplicate);
}

// The middleware has it, and it is all that a late subscriber may get.
TEST(TopicMirror, ALateSubscriberBehindANewSampleRepeatsNoOrder) {
  AfterABreak s;
  EXPECT_EQ(s.mirror(7).publish(2, sample("next"), TimePoint::max(), ms(1000)), std::nullopt);
  s.did();
  EXPECT_EQ(s.with(topic("/a").sub(50).sub(60, latched()), 1001), "");
  EXPECT_EQ(s.mirror(7).publish(2, sample("next"), TimePoint::max(), ms(1002)),
            DropReason::kDuplicate);
}

// Its subscribers had not found the mirror yet.
TEST(TopicMirror, WhatWaitedWhenItsLinkEndedComesAfterAll) {
  MirrorScript s;
  s.options.matching = std::chrono::milliseconds(60);
  s.offer(s.one, {origin(1, 7, latched(1))});
  EXPECT_EQ(s.mirror(7).publish(1, sample("order"), TimePoint::max(), ms(0)), std::nullopt);
  s.lose(s.one, 10);
  s.mirror(7).lose_link({1});
  s.context.mirrors.remove_candidate(s.mirror(7), {1}, ms(10));
  s.pass_to(1000);
  s.offer(s.one, {origin(1, 7, latched(1))}, 1000);
  s.did();
  EXPECT_EQ(s.mirror(7).publish(1, sample("order"), TimePoint::max(), ms(1000)), std::nullopt);
  s.pass_to(1060);
  EXPECT_NE(s.did().find("order"), std::string::npos);
}

// The exporter subscribes to such a topic as volatile, and then has no last samples.
TEST(TopicMirror, WhatItKeepsStaysBesideAVolatilePublisher) {
  MirrorScript s;
  s.offer(s.one, {origin(1, 7, latched(1)), origin(2, 8)});
  static_cast<void>(s.mirror(7).publish(1, sample("map"), TimePoint::max(), ms(0)));
  s.mirror(7).update(ms(0));
  s.did();
  s.graph = picture({topic("/a")});
  s.mirror(7).update(ms(1));
  EXPECT_EQ(s.did(), "");
}

// Another link may have offered the name with another type, and ended.
TEST(TopicMirror, WhatCouldNotBeMadeIsTriedAgain) {
  MirrorScript s;
  s.offer(s.one, {origin(1, 7)});
  s.did();
  s.mirror(7).on_failed({{1}, "type_mismatch", "the topic /a has another type here"}, ms(0));
  EXPECT_EQ(s.demanded(), "1: decline 1 type_mismatch\n2: ");
  s.pass_to(29'999);
  EXPECT_EQ(s.did(), "");
  s.pass_to(30'000);
  EXPECT_EQ(s.did(), "mirror 2 /a reliable volatile 10\n");
  s.mirror(7).on_failed({{2}, "type_mismatch", "the topic /a has another type here"}, ms(30'000));
  EXPECT_EQ(s.demanded(), "1: 2: ");  // it is declined already
  s.pass_to(60'000);
  EXPECT_EQ(s.did(), "mirror 3 /a reliable volatile 10\n");
  EXPECT_EQ(s.demanded(), "1: demand 1 on\n2: ");
  s.mirror(7).on_failed({{3}, "type_unknown", "not installed"}, ms(60'000));
  s.pass_to(200'000);
  EXPECT_EQ(s.did(), "");
}

// When a peer offers it again it is tried at once, and the peer is told if that fails.
TEST(TopicMirror, WhatIsOfferedAgainDoesNotWaitForItsNextAttempt) {
  MirrorScript s;
  s.offer(s.one, {origin(1, 7)});
  s.did();
  s.mirror(7).on_failed({{1}, "failed", "no memory"}, ms(0));
  EXPECT_EQ(s.demanded(), "1: decline 1 failed\n2: ");
  s.pass_to(30'000);
  s.mirror(7).on_failed({{2}, "failed", "no memory"}, ms(30'000));
  EXPECT_EQ(s.demanded(), "1: 2: ");
  EXPECT_EQ(s.did(), "mirror 2 /a reliable volatile 10\n");
  s.offer(s.two, {origin(1, 7)}, 31'000);
  EXPECT_EQ(s.did(), "mirror 3 /a reliable volatile 10\n");
}

// The link that feeds it again is as good as any other.
TEST(TopicMirror, WhatCouldBeMadeAfterAllStaysWithItsLink) {
  MirrorScript s;
  s.offer(s.one, {origin(1, 7)});
  s.did();
  s.mirror(7).on_failed({{1}, "type_mismatch", "the topic /a has another type here"}, ms(0));
  s.demanded();
  s.pass_to(30'000);
  EXPECT_EQ(s.demanded(), "1: demand 1 on\n2: ");
  s.offer(s.two, {origin(1, 7)}, 31'000);
  EXPECT_EQ(s.demanded(), "1: 2: ");
}

// Not even in between: of two links that offer it the rules allow neither any longer.
TEST(TopicMirror, IsNotMadeForALinkThatTheRulesDoNotAllow) {
  MirrorScript s;
  s.offer(s.one, {origin(1, 7)});
  s.offer(s.two, {origin(1, 7, latched(1))});
  s.did();
  s.policy = Policy{std::vector<Rule>{}};
  s.one.recheck(ms(0));
  EXPECT_EQ(s.did(), "unmirror 1\n");
  s.two.recheck(ms(0));
  EXPECT_EQ(s.did(), "");
}

// What the middleware keeps for late subscribers is bounded in bytes: by the depth, which follows
// the largest sample, of all mirrors that a link feeds.
TEST(TopicMirror, KeepsNoMoreBytesThanItsPeerMay) {
  MirrorScript s;
  s.options.mirror_bytes_max = 1000;
  s.offer(s.one, {origin(1, 7, latched(100)), origin(2, 8, latched(100))});
  s.demanded();
  EXPECT_EQ(s.did(), "mirror 1 /a reliable latched 100\nmirror 2 /a reliable latched 100\n");
  const std::string ten(6, 'x');  // with the header of a sample
  EXPECT_EQ(s.mirror(7).publish(1, sample(ten), TimePoint::max(), ms(0)), std::nullopt);
  EXPECT_EQ(s.mirror(7).kept_bytes(), 1000U);
  EXPECT_EQ(s.mirror(8).publish(1, sample(ten), TimePoint::max(), ms(0)), DropReason::kQueueBytes);
  EXPECT_EQ(s.did(), "publish 1 " + ten + "\n");
  // A larger one takes the place of several; the exporter is asked to send the last ones again.
  const std::string larger(96, 'x');
  EXPECT_EQ(s.mirror(7).publish(2, sample(larger), TimePoint::max(), ms(0)),
            DropReason::kQueueBytes);
  EXPECT_EQ(s.did(), "unmirror 1\nmirror 3 /a reliable latched 8\n");
  EXPECT_EQ(s.demanded(), "1: demand 1 off\n2: ");
  EXPECT_EQ(s.mirror(7).publish(2, sample(larger), TimePoint::max(), ms(0)), std::nullopt);
  EXPECT_EQ(s.mirror(7).kept_bytes(), 800U);
  EXPECT_EQ(s.mirror(8).publish(1, sample(larger), TimePoint::max(), ms(0)),
            DropReason::kQueueBytes);
  EXPECT_EQ(s.did(), "publish 3 " + larger + "\nunmirror 2\nmirror 4 /a reliable latched 2\n");
  EXPECT_EQ(s.mirror(8).publish(1, sample(larger), TimePoint::max(), ms(0)), std::nullopt);
}

// They hold no more of their link's share of the memory than they leave to its messages.
TEST(TopicMirror, SeveralLeaveMemoryToWhatIsUnderWay) {
  AccountOptions options;
  options.memory_bytes_max = 1'000'000;
  Shares all(options);
  OneLink robot(3, std::make_shared<Account>(options, &all));
  MirrorScript s;
  LinkTopics peer(s.context, robot.link);
  s.offer(peer, {origin(1, 7, latched(1000)), origin(2, 8, latched(1000)), origin(3, 9, latched(1)),
                 origin(4, 10, latched(1))});
  for (const std::uint8_t publisher : {7, 8}) {
    for (std::uint64_t number = 1; number <= 2; ++number)
      static_cast<void>(s.mirror(publisher).publish(number, sample(std::string(996, 'x')),
                                                    TimePoint::max(), ms(0)));
    EXPECT_GT(s.mirror(publisher).kept_bytes(), 50'000U) << int{publisher};
  }
  EXPECT_GE(robot.link.memory.room(), robot.link.mirrors.latched().used());
  // Of large samples a single one may take more.
  EXPECT_EQ(s.mirror(9).publish(1, sample(std::string(60'000, 'x')), TimePoint::max(), ms(0)),
            std::nullopt);
  EXPECT_GE(robot.link.memory.room(), robot.link.mirrors.latched().used());
  EXPECT_EQ(s.mirror(10).publish(1, sample(std::string(100'000, 'x')), TimePoint::max(), ms(0)),
            DropReason::kQueueBytes);
}

TEST(TopicMirror, APeerHasNoMoreThanItsShare) {
  MirrorScript s;
  s.options.mirrors_max = 3;
  s.options.topic_mirrors_max = 2;
  s.offer(s.one, {origin(1, 7), origin(2, 8), origin(3, 9)});
  EXPECT_EQ(s.context.mirrors.all().size(), 2U);
  // A reconnect gives no new share while the old one waits.
  s.lose(s.one);
  s.one.on_offer(channel(2, "/b", {origin(1, 10), origin(2, 11)}), ms(0));
  EXPECT_EQ(s.context.mirrors.all().size(), 3U);
  EXPECT_EQ(s.first.link.mirrors.all(), 3U);
  // Another peer has a share of its own, of which those that exist already are a part.
  s.offer(s.two, {origin(1, 7), origin(2, 12), origin(3, 13)});
  EXPECT_EQ(s.context.mirrors.all().size(), 4U);
  EXPECT_EQ(s.second.link.mirrors.all(), 2U);
  s.context.mirrors.remove_candidate(s.mirror(7), {2}, ms(0));
  EXPECT_EQ(s.second.link.mirrors.all(), 1U);
  s.did();
  EXPECT_NE(s.logged.find("no more mirrors for /peer at 10.0.0.1"), std::string::npos);
}

TEST(TopicMirror, AnotherQosMakesItAnew) {
  Rule changed = everything();
  changed.treatment.qos.depth = 3;
  MirrorScript s;
  s.offer(s.one, {origin(1, 7)});
  s.did();
  s.policy = Policy({changed});
  s.one.recheck(ms(0));
  s.one.renew(ms(0));
  EXPECT_EQ(s.did(), "unmirror 1\nmirror 2 /a reliable volatile 3\n");
}

TEST(TopicMirror, IsDemandedForAWhileBeforeItsSubscriberIsKnown) {
  MirrorScript s;
  s.graph = picture({});
  s.offer(s.one, {origin(1, 7)});
  s.mirror(7).expect_subscriber(ms(0));
  EXPECT_EQ(s.demanded(), "1: demand 1 on\n2: ");
  s.pass_to(5000);
  EXPECT_EQ(s.demanded(), "1: demand 1 off\n2: ");
}

TEST(TopicMirror, ThatCannotBeMadeIsDeclinedAtEachLink) {
  MirrorScript s;
  s.offer(s.one, {origin(1, 7)});
  s.offer(s.two, {origin(1, 7)});
  s.demanded();
  s.mirror(7).on_failed({{}, "unknown_type", "no such type"}, ms(0));
  EXPECT_EQ(s.demanded(), "1: decline 1 unknown_type\ndemand 1 off\n2: decline 1 unknown_type\n");
  s.did();
  EXPECT_EQ(s.logged, "cannot mirror /a: no such type\n");
}

}  // namespace
}  // namespace connect_bridge::topics_test
