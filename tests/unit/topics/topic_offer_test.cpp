#include "core/topics/topic_offer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <set>

#include "core/media/sample_codec.hpp"
#include "unit/media/samples.hpp"
#include "unit/topics/exporting.hpp"

namespace connect_bridge::topics_test {
namespace {

Payload bytes(std::size_t size) {
  return Payload::adopt(Bytes(size));
}

struct Offering : Exporting {
  explicit Offering(const Rule& rule = everything()) : Exporting({rule}) {
    see(topic("/a").pub(1, qos(5)));
    did();
  }
  std::uint64_t dropped(DropReason reason) const {
    LinkStatus status;
    offer.add_status(status);
    return status.topics.at(0).dropped.of(reason);
  }
  OneLink peer;
  TopicOffer offer{context, subject, peer.link};
};

OutSample sized(std::size_t size, std::uint32_t origin = 1) {
  return {OriginId{origin}, 0, 0, bytes(size), {}};
}

TEST(TopicOffer, OpensAChannelForWhatThePeerMayHave) {
  Offering s;
  const auto offered = s.offer.open();
  ASSERT_TRUE(offered);
  EXPECT_EQ(offered->name, "/a");
  EXPECT_EQ(offered->origins.size(), 1U);
  EXPECT_EQ(s.peer.link.outgoing(offered->channel), &s.offer);
  EXPECT_FALSE(s.offer.review());
}

// What it said is kept nowhere.
TEST(TopicOffer, ARuleMakesNoVolatilePublisherLatched) {
  auto latching = everything();
  latching.treatment.qos.durability = Durability::kTransientLocal;
  Offering s(latching);
  const auto offered = s.offer.open();
  ASSERT_TRUE(offered);
  EXPECT_EQ(offered->origins.at(0).qos.durability, Durability::kVolatile);
}

TEST(TopicOffer, WithoutARightThereIsNone) {
  Offering s(rule({"/b"}, {"/**"}));
  EXPECT_FALSE(s.offer.open());
  EXPECT_FALSE(s.offer.is_open());
  s.offer.withdraw({});
  EXPECT_EQ(s.peer.said(), "");
}

TEST(TopicOffer, NewRulesOrAcceptsMakeItStale) {
  Offering s;
  ASSERT_TRUE(s.offer.open());
  s.peer.link.accepts.adopt(Accepts{{{{"/b"}, {}}}, {}});
  EXPECT_EQ(s.offer.review()->reason, "the peer does not accept it any longer");
  s.offer.withdraw({});
  EXPECT_EQ(s.peer.said(), "withdraw 1\n");
  EXPECT_EQ(s.peer.link.outgoing({1}), nullptr);
}

// Nothing else is interrupted, and what waits stays.
TEST(TopicOffer, AChangedRateOrAgeIsFollowed) {
  Offering s;
  ASSERT_TRUE(s.offer.open());
  s.offer.on_demand({{1}, 1}, ms(0));
  s.peer.said();
  auto slower = everything();
  slower.treatment.max_rate = 1;
  slower.treatment.max_age = std::chrono::seconds(1);
  s.policy = Policy({slower});
  EXPECT_FALSE(s.offer.review());
  EXPECT_EQ(s.peer.said(), "");
  EXPECT_TRUE(s.offer.admit(sized(10), TopicOffer::Age::kNew, ms(10)));
  EXPECT_FALSE(s.offer.admit(sized(10), TopicOffer::Age::kNew, ms(20)));
  s.policy = Policy({everything()});
  EXPECT_FALSE(s.offer.review());
  EXPECT_TRUE(s.offer.admit(sized(10), TopicOffer::Age::kNew, ms(30)));
}

TEST(TopicOffer, AChangedRateLosesNoStateThatWasHeld) {
  auto slow = everything();
  slow.treatment.max_rate = 1;
  for (const double rate : {0.0, 2.0}) {
    Offering s(slow);
    ASSERT_TRUE(s.offer.open());
    s.offer.on_demand({{1}, 1}, ms(0));
    for (const std::uint64_t state : {5U, 6U, 5U, 6U}) {
      OutSample one = sized(10);
      one.state = state;
      static_cast<void>(s.offer.admit(one, TopicOffer::Age::kNew, ms(10)));
    }
    auto other = slow;
    other.treatment.max_rate = rate;
    s.policy = Policy({other});
    EXPECT_FALSE(s.offer.review());
    std::set<std::uint64_t> states;
    std::size_t left = 9;
    while (const auto held = s.offer.take_held(left, ms(11)))
      states.insert(held->state.value_or(0));
    EXPECT_EQ(states, (std::set<std::uint64_t>{5, 6}));
  }
}

// The peer has mirrors of the type that it was offered.
TEST(TopicOffer, WithAnotherDefinitionOfItsTypeItIsOfferedAgain) {
  Offering s;
  Topic hashed = topic("/a").pub(1, qos(5));
  hashed.type_hash = "RIHS01_first";
  s.see(hashed);
  ASSERT_TRUE(s.offer.open());
  hashed.type_hash = "RIHS01_other";
  s.see(hashed);
  EXPECT_EQ(s.offer.review()->reason, LinkOffer::offered_again().reason);
}

// Their sum is beyond 32 bits.
TEST(TopicOffer, DepthsOfTheGraphDoNotOverflow) {
  OneLink peer;
  Exporting s;
  Topic deep = topic("/a");
  for (std::uint8_t n = 1; n <= 4; ++n) deep.pub(n, latched(1U << 30));
  s.see(deep);
  ASSERT_TRUE(s.offer(peer));
  Exporting::demand(peer);
  for (int i = 0; i < 150; ++i) s.take(1, "x", i);
  LinkStatus status;
  s.subject.add_status(peer.link.id, status);
  EXPECT_EQ(status.topics.at(0).queued, 150U);
}

TEST(TopicOffer, TellsOfOriginsThatComeAndGo) {
  Offering s;
  ASSERT_TRUE(s.offer.open());
  s.see(topic("/a").pub(1).pub(2));
  s.offer.tell_origins();
  s.offer.remove_origins({{1}});
  EXPECT_EQ(s.peer.said(), "origins 1 +[2] -[]\norigins 1 +[] -[1]\n");
}

// It comes and goes before its turn.
TEST(TopicOffer, TheEndOfAnOriginThatWasNotToldIsNotTold) {
  Offering s;
  ASSERT_TRUE(s.offer.open());
  s.see(topic("/a").pub(1).pub(2));
  s.offer.remove_origins({{2}});
  EXPECT_EQ(s.peer.said(), "");
  s.offer.remove_origins({{1}});
  EXPECT_EQ(s.peer.said(), "origins 1 +[] -[1]\n");
}

TEST(TopicOffer, AnOriginThatWasNotToldMakesNoOtherOffer) {
  Offering s;
  ASSERT_TRUE(s.offer.open());
  s.see(topic("/a").pub(1).pub(2));
  EXPECT_FALSE(s.offer.review());
}

// A message behind the end of an origin may refer to no base of before.
TEST(TopicOffer, NoMessageOvertakesTheEndOfAnOrigin) {
  Rule urgent = everything();
  urgent.treatment.priority = Priority::kUrgent;
  Offering s(urgent);
  s.see(topic("/a").pub(1).pub(2));
  ASSERT_TRUE(s.offer.open());
  s.offer.on_demand({{1}, 1}, ms(0));
  s.offer.remove_origins({{1}});
  s.offer.send(sized(10, 2), Codec::kNone, bytes(10), ms(0));
  const std::string said = s.peer.said();
  EXPECT_EQ(said.find("origins 1 +[] -[1]"), 0U) << said;
}

TEST(TopicOffer, TakesNothingWithoutDemand) {
  Offering s;
  ASSERT_TRUE(s.offer.open());
  EXPECT_FALSE(s.offer.admit(sized(10), TopicOffer::Age::kNew, ms(0)));
  s.offer.send({{1}, 0, 0, sample("late"), {}}, Codec::kNone, sample("late"), ms(0));
  EXPECT_EQ(s.dropped(DropReason::kNoDemand), 1U);
}

TEST(TopicOffer, FormsThatThePeerDecodesHoldForTheDemand) {
  Offering s;
  ASSERT_TRUE(s.offer.open());
  const Decodes decodes{.vp8 = true, .planes = true};
  s.offer.on_demand({.channel = {1}, .number = 3, .decodes = decodes, .lossy = true}, ms(0));
  EXPECT_EQ(s.offer.decodes(), decodes);
  EXPECT_TRUE(s.offer.may_be_lossy());
  s.offer.on_demand({.channel = {1}, .number = 4}, ms(0));  // it is demanded already
  EXPECT_EQ(s.offer.decodes(), decodes);
  s.offer.on_demand({.channel = {1}, .decodes = decodes, .lossy = true}, ms(0));
  EXPECT_EQ(s.offer.decodes(), Decodes{});
  EXPECT_FALSE(s.offer.may_be_lossy());
}

// A thinned cloud looks like an exact one of fewer points.
TEST(TopicOffer, AKeptCloudOfARuleWithAGridAnswersNoExactDemand) {
  const media::TestCloud cloud{1, 500, media::kXyzi, 16, 8000, Bytes(8000)};
  const Bytes body =
      media::encode_sample(media::cloud_sample(cloud), {Codec::kCloud, 1, false}).value();
  const auto lost = [&](double grid, bool lossy) {
    Rule rule = everything();
    rule.treatment.compression.automatic = true;
    rule.treatment.keep = Keep::kNewest;
    rule.treatment.grid = grid;
    Offering s(rule);
    EXPECT_TRUE(s.offer.open());
    s.offer.on_demand({.channel = {1}, .number = 1, .decodes = {.cloud = true}, .lossy = lossy},
                      ms(0));
    Outbox::Unarrived kept;
    OutMessage& message = kept.messages.emplace_back();
    message.subject = OriginId{1};
    message.codec = Codec::kCloud;
    message.body = Payload::adopt(Bytes(body));
    s.offer.go_on(std::move(kept), ms(0));
    return s.dropped(DropReason::kLinkLost);
  };
  EXPECT_EQ(lost(0, false), 0U);
  EXPECT_EQ(lost(0.1, true), 0U);
  EXPECT_EQ(lost(0.1, false), 1U);
}

TEST(TopicOffer, TheNewestThatItsRateForbidsLeavesLater) {
  Rule limited = everything();
  limited.treatment.max_rate = 1;
  Offering s(limited);
  ASSERT_TRUE(s.offer.open());
  s.offer.on_demand({{1}, 1}, ms(0));
  EXPECT_TRUE(s.offer.admit(sized(10), TopicOffer::Age::kNew, ms(0)));
  EXPECT_FALSE(s.offer.admit(sized(11), TopicOffer::Age::kNew, ms(10)));
  EXPECT_EQ(s.dropped(DropReason::kRate), 0U);
  EXPECT_FALSE(s.offer.drained());
  EXPECT_FALSE(s.offer.admit(sized(12), TopicOffer::Age::kNew, ms(20)));
  EXPECT_EQ(s.dropped(DropReason::kRate), 1U);
  EXPECT_TRUE(s.offer.admit(sized(13), TopicOffer::Age::kKept, ms(30)));
  std::size_t left = 9;
  EXPECT_FALSE(s.offer.take_held(left, ms(1019)));
  const auto held = s.offer.take_held(left, ms(1020));
  ASSERT_TRUE(held);
  EXPECT_EQ(held->raw.size(), 12U);
  EXPECT_FALSE(s.offer.take_held(left, ms(9000)));
  EXPECT_FALSE(s.offer.admit(sized(14), TopicOffer::Age::kNew, ms(1030)));  // it counted
  s.offer.on_demand({}, ms(1040));
  EXPECT_EQ(s.dropped(DropReason::kNoDemand), 1U);
  EXPECT_FALSE(s.offer.take_held(left, ms(9000)));
}

// Frames without end: the rate holds no more of their messages than it has windows.
TEST(TopicOffer, StatesWithoutEndDoNotVoidTheRate) {
  Rule limited = everything();
  limited.treatment.max_rate = 1;
  Offering s(limited);
  ASSERT_TRUE(s.offer.open());
  s.offer.on_demand({{1}, 1}, ms(0));
  std::size_t passed = 0;
  for (std::uint64_t state = 0; state < 4 * RateLimit::kStatesMax; ++state) {
    OutSample sample = sized(10);
    sample.state = state;
    for (int i = 0; i < 2; ++i)
      passed += s.offer.admit(sample, TopicOffer::Age::kNew, ms(0)) ? 1 : 0;
  }
  EXPECT_EQ(passed, RateLimit::kStatesMax + 1);
  std::size_t held = 0;
  std::size_t left = 1000;
  while (s.offer.take_held(left, ms(5000))) ++held;
  EXPECT_EQ(held, RateLimit::kStatesMax + 1);
}

TEST(TopicOffer, WhatGoesToARobotIsKeptOverABreakOnlyIfARuleSaysSo) {
  const auto resumes = [](bool by_default, std::optional<bool> rule) {
    Rule resumed = everything();
    resumed.treatment.resume = rule;
    Offering s(resumed);
    s.options.resumes_exported = by_default;
    OneLink lasting(2, std::make_shared<Account>(), std::chrono::minutes(1));
    TopicOffer offer(s.context, s.subject, lasting.link);
    EXPECT_TRUE(offer.open());
    return offer.may_resume();
  };
  EXPECT_TRUE(resumes(true, {}));
  EXPECT_FALSE(resumes(true, false));
  EXPECT_FALSE(resumes(false, {}));
  EXPECT_TRUE(resumes(false, true));
}

// A sample may wait until its publisher is known; a link that opens meanwhile must not get it.
TEST(TopicOffer, OfWhatDrivesNothingGoesThatCameBeforeTheConnection) {
  for (const bool drives : {true, false}) {
    Rule driving = everything();
    driving.treatment.drives = drives;
    Offering s(driving);
    ASSERT_TRUE(s.offer.open());
    s.peer.link.life.opened(ms(100));
    s.offer.on_demand({{1}, 1}, ms(150));
    OutSample before = sized(10);
    before.taken = ms(90).steady;
    OutSample after = sized(10);
    after.taken = ms(110).steady;
    EXPECT_EQ(s.offer.admit(before, TopicOffer::Age::kNew, ms(160)), !drives);
    EXPECT_TRUE(s.offer.admit(after, TopicOffer::Age::kNew, ms(160)));
    EXPECT_EQ(s.offer.admit(after, TopicOffer::Age::kKept, ms(160)), !drives);
  }
}

TEST(TopicOffer, WhatWaitsForTooLongIsToldOnceWithItsCure) {
  Offering s;
  ASSERT_TRUE(s.offer.open());
  s.offer.on_demand({{1}, 1}, ms(0));
  for (int at = 0; at < 5000; at += 100)
    s.offer.send(sized(1000), Codec::kNone, bytes(1000), ms(at));
  s.did();
  EXPECT_EQ(s.logged.find("keep: newest"), std::string::npos);
  for (int at = 5000; at < 8000; at += 100)
    s.offer.send(sized(1000), Codec::kNone, bytes(1000), ms(at));
  s.did();
  EXPECT_GT(s.dropped(DropReason::kQueueTime), 0U);
  const auto told = s.logged.find("/a: the link to");
  EXPECT_NE(told, std::string::npos);
  EXPECT_NE(s.logged.find("keep: newest"), std::string::npos);
  EXPECT_EQ(s.logged.find("/a: the link to", told + 1), std::string::npos);
}

TEST(TopicOffer, WhatARateHoldsCountsAsQueuedAndIsLostWithTheLink) {
  Rule limited = everything();
  limited.treatment.max_rate = 1;
  Offering s(limited);
  ASSERT_TRUE(s.offer.open());
  s.offer.on_demand({{1}, 1}, ms(0));
  EXPECT_TRUE(s.offer.admit(sized(10), TopicOffer::Age::kNew, ms(0)));
  EXPECT_FALSE(s.offer.admit(sized(11), TopicOffer::Age::kNew, ms(10)));
  LinkStatus status;
  s.offer.add_status(status);
  EXPECT_EQ(status.topics.at(0).queued, 1U);
  s.offer.drop_held(DropReason::kLinkLost);
  EXPECT_EQ(s.dropped(DropReason::kLinkLost), 1U);
  EXPECT_TRUE(s.offer.drained());
}

TEST(TopicOffer, EachPublisherHasItsRate) {
  Rule limited = everything();
  limited.treatment.max_rate = 1;
  Offering s(limited);
  s.see(topic("/a").pub(1).pub(2));
  ASSERT_TRUE(s.offer.open());
  s.offer.on_demand({{1}, 1}, ms(0));
  EXPECT_TRUE(s.offer.admit(sized(10, 1), TopicOffer::Age::kNew, ms(0)));
  EXPECT_TRUE(s.offer.admit(sized(10, 2), TopicOffer::Age::kNew, ms(1)));
  EXPECT_FALSE(s.offer.admit(sized(10, 1), TopicOffer::Age::kNew, ms(2)));
}

TEST(TopicOffer, CountsWhatIsTooLargeForThePeer) {
  Offering s;
  s.peer.link.connection()->set_peer_message_bytes_max(100);
  ASSERT_TRUE(s.offer.open());
  s.offer.on_demand({{1}, 1}, ms(0));
  EXPECT_FALSE(s.offer.admit(sized(101), TopicOffer::Age::kNew, ms(0)));
  EXPECT_FALSE(s.offer.admit(sized(102), TopicOffer::Age::kNew, ms(0)));
  EXPECT_FALSE(s.offer.admit(sized(103), TopicOffer::Age::kKept, ms(0)));
  EXPECT_EQ(s.dropped(DropReason::kTooLarge), 3U);
  s.did();
  EXPECT_EQ(
      s.logged,
      "a message of 101 bytes on /a is larger than the max_message_size of /peer at 10.0.0.1; "
      "such messages are dropped\n");
}

TEST(TopicOffer, ThePeerLearnsOfWhatIsTooLarge) {
  Offering s;
  s.peer.link.connection()->set_peer_message_bytes_max(100);
  ASSERT_TRUE(s.offer.open());
  s.offer.on_demand({{1}, 1}, ms(0));
  s.peer.said();
  EXPECT_FALSE(s.offer.admit(sized(101), TopicOffer::Age::kNew, ms(0)));
  EXPECT_EQ(s.peer.said(), "origins 1 +[] -[] too large 1 (101)\n");
  EXPECT_FALSE(s.offer.admit(sized(102), TopicOffer::Age::kNew, ms(9'999)));
  EXPECT_EQ(s.peer.said(), "");
  EXPECT_FALSE(s.offer.admit(sized(103), TopicOffer::Age::kNew, ms(10'000)));
  EXPECT_EQ(s.peer.said(), "origins 1 +[] -[] too large 3 (103)\n");
}

// A peer that accepts a topic no longer, and then again, has another offer of it.
TEST(TopicOffer, OfWhatIsTooLargeAnIdentityHasOneLine) {
  const auto account = std::make_shared<Account>();
  OneLink first(1, account), second(2, account), other(3);
  Offering s;
  const auto drop_one = [&](Link& link) {
    link.connection()->set_peer_message_bytes_max(100);
    TopicOffer again(s.context, s.subject, link);
    ASSERT_TRUE(again.open());
    again.on_demand({{1}, 1}, ms(0));
    EXPECT_FALSE(again.admit(sized(101), TopicOffer::Age::kNew, ms(0)));
  };
  for (OneLink* peer : {&first, &first, &second, &other}) drop_one(peer->link);
  s.did();
  EXPECT_EQ(std::count(s.logged.begin(), s.logged.end(), '\n'), 2) << s.logged;
}

// A moment is as it should be; minutes are a person's business.
TEST(TopicOffer, StatesThatAreReplacedForLongAreSaidOnce) {
  const auto logged = [](Keep keep, std::int64_t until) {
    OneLink peer;
    Rule rule = everything();
    rule.treatment.keep = keep;
    Exporting s({rule});
    s.see(topic("/a").pub(1));
    EXPECT_TRUE(s.offer(peer));
    Exporting::demand(peer);
    for (std::int64_t at = 100; at <= until; at += 100) s.take(1, "pose", at);
    s.did();
    return s.logged;
  };
  EXPECT_EQ(logged(Keep::kNewest, 14'000), "");
  const std::string line = logged(Keep::kNewest, 40'000);
  EXPECT_THAT(line, testing::HasSubstr("/a: the link to "));
  EXPECT_THAT(line, testing::HasSubstr("newer ones replace the others. `max_rate`"));
  EXPECT_EQ(std::count(line.begin(), line.end(), '\n'), 1);
  EXPECT_EQ(logged(Keep::kAll, 40'000).find("newer ones replace"), std::string::npos);
}

}  // namespace
}  // namespace connect_bridge::topics_test
