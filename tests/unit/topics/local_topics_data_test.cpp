// A sample from its subscription to the links: attributed, admitted, compressed, counted.
#include <gtest/gtest.h>

#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

// One link that demands /a of publisher 1 by subscription 2, treated so.
Script demanding(const Treatment& treatment, SideOptions options = server()) {
  auto treated = everything();
  treated.treatment = treatment;
  options.policy = Policy({treated});
  return Script(std::move(options));
}
void begin(Script& s, const Qos& q = qos()) {
  s.graph({topic("/a").pub(1, q)});
  s.join(1);
  s.demand(1, 1);
  s.did();
}

TEST(SideExportsData, AClientTellsItsLimitWithWhatItAccepts) {
  auto s = demanding({});
  begin(s);
  s.take(2, 1, "a larger sample");
  EXPECT_EQ(s.said(1), "1.1 a larger sample\n");
  Accepts accepts{{{{"/**"}, {}}}, {}, 10};
  s.say(1, accepts);
  s.take(2, 1, "a larger sample");
  s.take(2, 1, "small");
  EXPECT_EQ(s.said(1), "1.1 small\norigins 1 +[] -[] too large 1 (19)\n");
  EXPECT_EQ(s.dropped(DropReason::kTooLarge), 1U);
  accepts.message_bytes_max = 0;  // not told: as it was
  s.say(1, accepts);
  s.take(2, 1, "a larger sample");
  EXPECT_EQ(s.said(1), "");
  EXPECT_EQ(s.dropped(DropReason::kTooLarge), 2U);
}

TEST(SideExportsData, EverySideTellsItsLimit) {
  auto options = server();
  options.reassembly.message_bytes_max = 12345;
  Script s(options);
  s.login(1);
  const auto packet = s.side.next_packet({1}, flow_test::now_ms(s.at));
  ASSERT_TRUE(packet);
  const Bytes text = flow_test::joined(*packet);
  const auto accepts = decode_control({reinterpret_cast<const char*>(text.data()), text.size()});
  ASSERT_TRUE(accepts);
  EXPECT_EQ(std::get<Accepts>(accepts.value()).message_bytes_max, 12345U);
}

// What a peer accepts is compared with every interface of the graph.
TEST(SideExportsData, PatternsBeyondWhatIsComparedAreRefused) {
  const auto member = [](std::size_t which, std::size_t count) {
    const std::vector<std::string> patterns(count, "/a");
    Accepts accepts{{{}}, {}};
    AcceptedNames& rule = accepts.rules[0];
    std::vector<std::string>* lists[] = {&rule.topics,  &rule.types,      &rule.services,
                                         &rule.actions, &rule.parameters, &accepts.deny};
    *lists[which] = patterns;
    lists[(which + 1) % 6]->push_back("/b");
    return accepts;
  };
  for (std::size_t which = 0; which < 6; ++which) {
    Script s(server());
    s.login(1);
    s.say(1, member(which, 4095));
    EXPECT_EQ(s.did().find("close"), std::string::npos) << which;
    s.say(1, member(which, 4096));
    EXPECT_NE(s.did().find("close 1 4006"), std::string::npos) << which << s.did();
  }
}

TEST(SideExportsData, LossesBelowAreCounted) {
  auto s = demanding({});
  begin(s);
  s.give(MessagesLost{{2}, 3, false});
  s.give(MessagesLost{{2}, 5, true});
  s.give(MessagesLost{{77}, 9, true});
  EXPECT_EQ(s.dropped(DropReason::kLostHere), 3U);
  EXPECT_EQ(s.dropped(DropReason::kTooLarge), 5U);
}

// One moment, however much of it: the middleware kept no more while this side stood still.
TEST(SideExportsData, ALossThatGoesOnIsNamedUntilItIsOver) {
  auto s = demanding({});
  begin(s);
  const auto named = [&] {
    const auto status = s.status();
    const auto& names = status.links.at(0).missing;
    return std::any_of(names.begin(), names.end(), [](const MissingName& name) {
      return name.reason == MissingReason::kLost && name.name == "/a";
    });
  };
  s.give(MessagesLost{{2}, 1000, false});
  s.pass(25'000);
  EXPECT_FALSE(named());
  for (int second = 0; second < 25; ++second) {
    s.give(MessagesLost{{2}, 5, false});
    s.pass(1000);
  }
  EXPECT_TRUE(named());
  s.pass(45'000);
  EXPECT_FALSE(named());
}

TEST(SideExportsData, SamplesOfABridgeDoNotCross) {
  auto s = demanding({});
  begin(s);
  s.graph({topic(kClaimsTopic).pub(9, {}, "bridge"), topic("/a").pub(1).pub(7, {}, "bridge")});
  s.take(2, 7, "comes from elsewhere");
  s.pass(2000);
  EXPECT_EQ(s.said(1), "");
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.dropped(DropReason::kUnknownOrigin), 0U);
}

TEST(SideExportsData, WithoutAnOriginASampleIsTheOnlyPublishers) {
  auto s = demanding({});
  begin(s);
  s.give(MessageTaken{{2}, Gid{}, 0, sample("whose")});
  EXPECT_EQ(s.said(1), "1.1 whose\n");
}

// As with /tf_static under a Cyclone DDS whose handles cannot be found: nobody knows whose they
// are.
TEST(SideExportsData, WithoutOriginsLatchedSamplesOfSeveralPublishersAllCross) {
  auto s = demanding({});
  s.graph({topic("/a").pub(1, latched(1)).pub(2, latched(1))});
  s.join(1);
  s.demand(1, 1);
  s.did();
  s.give(MessageTaken{{2}, Gid{}, 7'000'000'000, sample("base to arm")});
  s.give(MessageTaken{{2}, Gid{}, 2'000'000'000, sample("base to mast"), 1});  // older
  EXPECT_EQ(s.said(1), "1.1 base to arm, 1.2 base to mast\n");
  EXPECT_EQ(s.dropped(DropReason::kDuplicate), 0U);
  s.join(2);
  s.demand(2, 1);
  EXPECT_EQ(s.said(2), "1.1 base to arm, 1.2 base to mast\n");
}

TEST(SideExportsData, ASlowPeerGetsTheNewest) {
  auto s = demanding({});
  begin(s, best_effort(2));
  for (const char* text : {"a", "b", "c", "d"}) s.take(2, 1, text);
  EXPECT_EQ(s.said(1), "1.1 c, 1.1 d\n");
  EXPECT_EQ(s.dropped(DropReason::kQueueDepth), 2U);
}

// As with a middleware that does not tell the depth.
TEST(SideExportsData, WhatAReliablePublisherSaysAtOnceIsNotLostForItsDepth) {
  auto s = demanding({});
  begin(s, qos(2));
  for (const char* text : {"a", "b", "c", "d"}) s.take(2, 1, text);
  EXPECT_EQ(s.said(1), "1.1 a, 1.1 b, 1.1 c, 1.1 d\n");
}

TEST(SideExportsData, OnePublisherDoesNotTakeTheOthersPlace) {
  auto s = demanding({});
  s.graph({topic("/a").pub(1, best_effort(1)).pub(2, best_effort(1))});
  s.join(1);
  s.demand(1, 1);
  s.take(2, 1, "a");
  s.take(2, 2, "b");
  EXPECT_EQ(s.said(1), "1.1 a, 1.2 b\n");
}

TEST(SideExportsData, TheClockKeepsItsNewestOnly) {
  Script s(server());
  auto clock = topic("/clock").pub(1);
  clock.type = "rosgraph_msgs/msg/Clock";
  s.graph({clock});
  s.join(1);
  s.demand(1, 1);
  s.take(2, 1, "1");
  s.take(2, 1, "2");
  EXPECT_EQ(s.said(1), "1.1 2\n");
  EXPECT_EQ(s.dropped(DropReason::kNewerAvailable), 1U);
}

TEST(SideExportsData, AClockThatIsSetBackTakesNoSamplesAway) {
  auto s = demanding({});
  begin(s, latched(10));
  s.take(2, 1, "a", 7000, 1);
  s.take(2, 1, "b", 2000, 2);
  s.take(2, 1, "c", 2010, 3);
  EXPECT_EQ(s.said(1), "1.1 a, 1.1 b, 1.1 c\n");
}

// Then the stamp must do.
TEST(SideExportsData, WithoutNumbersWhatAClockThatIsSetBackTakesAwayIsCounted) {
  auto s = demanding({});
  begin(s, latched(10));
  s.take(2, 1, "a", 7000, 0);
  s.take(2, 1, "b", 2000, 0);
  EXPECT_EQ(s.said(1), "1.1 a\n");
  EXPECT_EQ(s.dropped(DropReason::kDuplicate), 1U);
}

// They are not sent again: not the queue's byte limit applies to them, but the history's.
TEST(SideExportsData, TheLastSamplesOfAllReachASecondPeerAtOnce) {
  Treatment treatment;
  treatment.queue_bytes_max = 20;
  auto s = demanding(treatment);
  s.graph({topic("/a").pub(1, latched(1)).pub(2, latched(1))});
  s.join(1);
  s.demand(1, 1);
  s.take(2, 1, "a large map");
  s.take(2, 2, "another map");
  EXPECT_EQ(s.said(1), "1.1 a large map, 1.2 another map\n");
  s.join(2);
  s.demand(2, 1);
  EXPECT_EQ(s.said(2), "1.1 a large map, 1.2 another map\n");
}

// A step is short, however many publishers and states a rate holds.
TEST(SideExportsData, WhatARateHoldsLeavesInSeveralSteps) {
  Treatment limited;
  limited.max_rate = 1;
  auto s = demanding(limited);
  Topic many = topic("/a");
  for (std::uint8_t n = 1; n <= 100; ++n) many = many.pub(n);
  s.graph({many});
  s.join(1);
  s.demand(1, 1);
  s.did();
  for (const char* text : {"passes", "held"})
    for (std::uint8_t n = 1; n <= 100; ++n) s.take(2, n, text);
  s.said(1);
  s.at += 1000;
  const auto held = [&] {
    s.give(TimePassed{});
    const std::string said = s.said(1);
    std::size_t count = 0;
    for (auto at = said.find("held"); at != std::string::npos; at = said.find("held", at + 1))
      ++count;
    return count;
  };
  EXPECT_EQ(held(), 64U);
  EXPECT_LE(s.side.next_deadline(), flow_test::now_ms(s.at).steady);
  EXPECT_EQ(held(), 36U);
  EXPECT_EQ(held(), 0U);
}

}  // namespace
}  // namespace connect_bridge::side_test
