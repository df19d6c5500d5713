#include "core/topics/mirror.hpp"

#include <gtest/gtest.h>

#include "unit/topics/importing.hpp"

namespace connect_bridge::topics_test {
namespace {

// Two links that may offer the same origin, publisher 7.
struct Script : Importing {
  explicit Script(std::vector<Rule> rules = {everything()}) : Importing(std::move(rules)) {
    listen();
  }
  std::string demanded() {
    one.send_demands();
    two.send_demands();
    return "1: " + first.said() + "2: " + second.said();
  }

  OneLink first{1}, second{2};
  PeerTopics one{context, first.link};
  PeerTopics two{context, second.link};
};

TEST(Mirror, IsFedByTheFirstLinkThatOffersIt) {
  Script s;
  s.offer(s.one, {origin(1, 7)});
  s.offer(s.two, {origin(1, 7)});
  EXPECT_EQ(s.did(), "mirror 1 /a reliable volatile 10\n");
  EXPECT_EQ(s.demanded(), "1: demand 1 on\n2: ");
  EXPECT_EQ(s.mirror(7).refusal(s.first.link), std::nullopt);
  EXPECT_EQ(s.mirror(7).refusal(s.second.link), DropReason::kDuplicate);
}

TEST(Mirror, AnotherLinkTakesOverWhenTheFirstIsLost) {
  Script s;
  s.offer(s.one, {origin(1, 7)});
  s.offer(s.two, {origin(1, 7)});
  s.demanded();
  s.did();
  s.one.on_link_lost(ms(0));
  EXPECT_EQ(s.demanded(), "1: 2: demand 1 on\n");
  EXPECT_EQ(s.mirror(7).refusal(s.second.link), std::nullopt);
  EXPECT_EQ(s.did(), "");  // the publisher is the same
}

TEST(Mirror, WaitsForALinkThatIsLostAlone) {
  Script s;
  s.offer(s.one, {origin(1, 7)});
  s.did();
  s.one.on_link_lost(ms(0));
  s.pass_to(10'000);
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.mirror(7).candidate({1})->offered, nullptr);
}

TEST(Mirror, LingersWhenNobodyOffersIt) {
  Script s;
  s.offer(s.one, {origin(1, 7)});
  s.did();
  s.context.remove_candidate(s.mirror(7), {1}, ms(0));
  EXPECT_EQ(s.context.timers.deadline(), ms(200).steady);
  EXPECT_FALSE(s.mirror(7).is_over());
  s.pass_to(200);
  EXPECT_EQ(s.did(), "unmirror 1\n");
  EXPECT_TRUE(s.mirror(7).is_over());
}

TEST(Mirror, OfAnOriginThatIsHereThereIsNone) {
  Script s;
  s.graph = picture({topic("/a").pub(7).sub(50)});
  s.offer(s.one, {origin(1, 7)});
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.mirror(7).refusal(s.first.link), DropReason::kNoDemand);
}

TEST(Mirror, AsksForDataOnlyWhenTheGraphIsDiscovered) {
  Script s;
  s.context.graph_since = ms(0).steady;
  s.offer(s.one, {origin(1, 7)});
  EXPECT_EQ(s.did(), "mirror 1 /a reliable volatile 10\n");
  EXPECT_EQ(s.demanded(), "1: 2: ");
  s.pass_to(500);
  EXPECT_EQ(s.demanded(), "1: demand 1 on\n2: ");
}

TEST(Mirror, OfALatchedOriginPublishesNoSampleTwice) {
  Script s;
  s.offer(s.one, {origin(1, 7, latched())});
  EXPECT_TRUE(s.mirror(7).publish(5, sample("five")));
  EXPECT_FALSE(s.mirror(7).publish(5, sample("five")));
  EXPECT_FALSE(s.mirror(7).publish(4, sample("four")));
  EXPECT_TRUE(s.mirror(7).publish(6, sample("six")));
}

// A peer must not make the middleware keep all, or watch what comes within a nanosecond.
TEST(Mirror, AsksNoMoreOfTheMiddlewareThanItCanBear) {
  Script s;
  Qos hungry = qos(5);
  hungry.history = History::kKeepAll;
  hungry.deadline = hungry.lifespan = hungry.liveliness_lease = Duration{1};
  s.offer(s.one, {origin(1, 7, hungry)});
  std::optional<CreateMirror> made;
  while (auto action = s.outputs.next())
    if (auto* mirror = std::get_if<CreateMirror>(&*action)) made = *mirror;
  ASSERT_TRUE(made);
  EXPECT_EQ(made->qos.history, History::kKeepLast);
  EXPECT_EQ(made->qos.depth, 10'000U);
  for (const Duration period : {made->qos.deadline, made->qos.lifespan, made->qos.liveliness_lease})
    EXPECT_EQ(period, std::chrono::milliseconds(1));
}

TEST(Mirror, AnotherQosMakesItAnew) {
  Rule changed = everything();
  changed.treatment.qos.depth = 3;
  Script s;
  s.offer(s.one, {origin(1, 7)});
  s.did();
  s.policy = Policy({changed});
  s.one.recheck(ms(0));
  s.one.renew(ms(0));
  EXPECT_EQ(s.did(), "unmirror 1\nmirror 2 /a reliable volatile 3\n");
}

TEST(Mirror, IsDemandedForAWhileBeforeItsSubscriberIsKnown) {
  Script s;
  s.graph = picture({});
  s.offer(s.one, {origin(1, 7)});
  s.mirror(7).expect_subscriber(ms(0));
  EXPECT_EQ(s.demanded(), "1: demand 1 on\n2: ");
  s.pass_to(5000);
  EXPECT_EQ(s.demanded(), "1: demand 1 off\n2: ");
}

TEST(Mirror, ThatCannotBeMadeIsDeclinedAtEachLink) {
  Script s;
  s.offer(s.one, {origin(1, 7)});
  s.offer(s.two, {origin(1, 7)});
  s.demanded();
  s.mirror(7).on_failed("unknown_type", "no such type", ms(0));
  EXPECT_EQ(s.demanded(), "1: decline 1 unknown_type\ndemand 1 off\n2: decline 1 unknown_type\n");
  s.did();
  EXPECT_EQ(s.logged, "cannot mirror /a: no such type\n");
}

}  // namespace
}  // namespace connect_bridge::topics_test
