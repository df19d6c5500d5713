// How a topic's samples get to the links that want them.
#include "core/topics/topic_offers.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "unit/topics/exporting.hpp"

namespace connect_bridge::topics_test {
namespace {

Rule compressed_with(const Compression& how) {
  Rule rule = everything();
  rule.treatment.compression = how;
  return rule;
}
const Compression kZstd{Codec::kZstd, 5};
const Compression kLz4{Codec::kLz4};
const Compression kWhereItPays{.automatic = true};

// Links that demand /a, which is compressed so; from 1000 bytes on by a worker.
struct Offered {
  Offered(const std::vector<OneLink*>& peers, const Compression& how,
          const Qos& with = side_test::qos(10))
      : s({compressed_with(how)}) {
    s.see(topic("/a").pub(1));
    subject.on_subscribed(with);
    for (OneLink* peer : peers) {
      TopicOffer& offer = subject.add(s.subject, peer->link);
      EXPECT_TRUE(offer.open());
      offer.on_demand({{1}, 1}, ms(0));
    }
    s.did();
  }

  Compression way(OneLink& peer, std::size_t bytes) {
    return subject.way_to(subject.find(peer.link.id)->second, bytes, ms(0));
  }
  // So many bytes of this letter, for these links.
  void encode(const Compression& how, std::size_t bytes, char letter,
              const std::vector<OneLink*>& peers, std::int64_t at = 100) {
    OutSample taken{OriginId{1}, flow_test::at_ms(at), 0, sample(std::string(bytes, letter)), {}};
    for (const OneLink* peer : peers) taken.targets.push_back(peer->link.id);
    subject.encode(how, std::move(taken), ms(at));
  }
  void shrunk(std::size_t bytes = 3, std::int64_t at = 100) {
    s.finish(Payload::adopt(Bytes(bytes)), at);
  }
  void did_not_shrink(std::int64_t at = 100) { s.finish(std::nullopt, at); }
  std::uint64_t dropped(const OneLink& peer, DropReason reason) const {
    LinkStatus status;
    subject.find(peer.link.id)->second.add_status(status);
    return status.topics.at(0).dropped.of(reason);
  }

  Exporting s;
  TopicOffers subject{s.context, {s.context.timers, &s.subject}};
};

TEST(TopicOffers, ARuleSaysHowLargeSamplesAreCompressed) {
  OneLink peer;
  Offered s({&peer}, kZstd);
  EXPECT_EQ(s.way(peer, 1000), kZstd);
  EXPECT_EQ(s.way(peer, 999), Compression{});  // as they leave, against what the peer has
  Offered plain({&peer}, {});
  EXPECT_EQ(plain.way(peer, 1'000'000), Compression{});
}

TEST(TopicOffers, SmallSamplesAreCompressedHereWithLz4Only) {
  OneLink peer;
  Offered s({&peer}, kLz4);
  EXPECT_EQ(s.way(peer, 10), kLz4);
  s.encode(kLz4, 500, 'x', {&peer});
  EXPECT_EQ(peer.said(100), "1.1 lz4\n");
  EXPECT_EQ(s.s.did(), "");
  EXPECT_EQ(s.subject.bytes(), 0U);
}

TEST(TopicOffers, ASampleIsCompressedOnceForAllItsLinks) {
  OneLink one(1), two(2), three(3);
  Offered s({&one, &two, &three}, kZstd);
  s.encode(kZstd, 2000, 'x', {&one, &two});
  EXPECT_EQ(s.s.did(), "compress 1\n");
  EXPECT_EQ(s.subject.bytes(), 2004U);
  s.shrunk();
  EXPECT_EQ(s.s.did(), "");
  EXPECT_EQ(one.said(100), "1.1 zstd\n");
  EXPECT_EQ(two.said(100), "1.1 zstd\n");
  EXPECT_EQ(three.said(100), "");
  EXPECT_EQ(s.subject.bytes(), 0U);
}

TEST(TopicOffers, NothingOvertakesWhatIsBeingCompressedForTheSameLink) {
  OneLink one(1), two(2);
  Offered s({&one, &two}, kZstd);
  s.encode(kZstd, 2000, 'x', {&one});
  EXPECT_EQ(s.way(one, 10), kZstd);
  EXPECT_EQ(s.way(two, 10), Compression{});
  s.encode(kZstd, 2000, 'y', {&two});  // waits for the worker
  EXPECT_EQ(s.way(two, 10), kZstd);
  s.s.did();
  s.shrunk();
  EXPECT_EQ(s.way(one, 10), Compression{});
}

// What their links cannot carry has not cost a worker's time.
TEST(TopicOffers, BehindTheWorkerNoMoreWaitThanTheSubscriptionKeeps) {
  OneLink one(1), two(2);
  Offered s({&one, &two}, kZstd, qos(2));
  s.encode(kZstd, 2000, 'x', {&one});  // the worker's
  s.encode(kZstd, 2000, 'y', {&one, &two});
  s.encode(kZstd, 2000, 'y', {&one});
  EXPECT_EQ(s.dropped(one, DropReason::kQueueBytes), 0U);
  s.encode(kZstd, 2000, 'z', {&one});
  EXPECT_EQ(s.dropped(one, DropReason::kQueueBytes), 1U);
  EXPECT_EQ(s.dropped(two, DropReason::kQueueBytes), 1U);
  EXPECT_EQ(s.subject.bytes(), 3 * 2004U);
}

// They come at once, and no other ones will.
TEST(TopicOffers, AllLastSamplesOfLatchedOriginsGetThrough) {
  constexpr std::size_t kOneMiB = 1 << 20;
  OneLink peer;
  Offered s({&peer}, kZstd, latched(2));
  for (int i = 0; i < 8; ++i) s.encode(kZstd, kOneMiB, 'x', {&peer});
  EXPECT_EQ(s.dropped(peer, DropReason::kQueueBytes), 0U);
}

TEST(TopicOffers, ALinkThatIsForgottenGetsNothingThatIsUnderWay) {
  OneLink one(1), two(2);
  Offered s({&one, &two}, kZstd);
  s.encode(kZstd, 2000, 'x', {&one, &two});
  s.encode(kZstd, 2000, 'y', {&one});
  const auto forgotten = s.subject.take_under_way(one.link.id);
  ASSERT_EQ(forgotten.size(), 2U);
  EXPECT_EQ(text_of(forgotten.at(0).raw.view()).front(), 'x');
  EXPECT_EQ(text_of(forgotten.at(1).raw.view()).front(), 'y');
  EXPECT_TRUE(s.subject.take_under_way(one.link.id).empty());
  EXPECT_EQ(s.way(one, 10), Compression{});
  EXPECT_EQ(s.s.did(), "compress 1\n");  // for the other one
  s.shrunk();
  EXPECT_EQ(one.said(100), "");
  EXPECT_EQ(two.said(100), "1.1 zstd\n");
  EXPECT_EQ(s.s.did(), "");
}

TEST(TopicOffers, AResultForALinkThatIsGoneIsNobodys) {
  OneLink one(1), two(2);
  Offered s({&one, &two}, kZstd);
  s.encode(kZstd, 2000, 'x', {&one, &two});
  s.subject.erase(one.link.id);
  s.s.did();
  s.shrunk();
  EXPECT_EQ(one.said(100), "");
  EXPECT_EQ(two.said(100), "1.1 zstd\n");
}

TEST(TopicOffers, WhatIsClearedIsDroppedForAllAndTheWorkersResultIsNobodys) {
  OneLink one(1), two(2);
  Offered s({&one, &two}, kZstd);
  s.encode(kZstd, 2000, 'x', {&one, &two});
  s.encode(kZstd, 2000, 'y', {&one});
  s.subject.drop_under_way();
  EXPECT_EQ(s.dropped(one, DropReason::kNoDemand), 2U);
  EXPECT_EQ(s.dropped(two, DropReason::kNoDemand), 1U);
  EXPECT_EQ(s.subject.bytes(), 0U);
  EXPECT_EQ(s.s.did(), "compress 1\ncancel 1\n");
  s.shrunk();
  EXPECT_EQ(one.said(100), "");
}

// ---- where it pays

TEST(TopicOffers, WhereNothingIsKnownOfThePathNothingIsTried) {
  OneLink peer;
  Offered s({&peer}, kWhereItPays);
  EXPECT_EQ(s.way(peer, 100'000), Compression{});
}

TEST(TopicOffers, ASlowPathIsWorthMoreWorkThanAFastOne) {
  OneLink slow(1), fast(2);
  Offered s({&slow, &fast}, kWhereItPays);
  slow.show_round_trip(50);
  fast.show_round_trip(5);
  EXPECT_EQ(s.way(slow, 100'000), (Compression{Codec::kZstd, 3, true}));
  EXPECT_EQ(s.way(fast, 100'000), (Compression{Codec::kZstd, 1, true}));
  EXPECT_EQ(s.way(slow, 999), Compression{});
}

TEST(TopicOffers, AfterOneInVainItIsTriedFromTimeToTimeOnly) {
  OneLink peer;
  Offered s({&peer}, kWhereItPays);
  peer.show_round_trip();
  const Compression how = s.way(peer, 2000);
  s.encode(how, 2000, 'x', {&peer});
  s.s.did();
  s.did_not_shrink();
  EXPECT_EQ(s.s.did(), "");
  int tries = 0;
  for (int i = 0; i < 640; ++i)
    if (s.way(peer, 2000) != Compression{}) ++tries;
  EXPECT_EQ(tries, 10);
  s.encode(how, 2000, 'x', {&peer});
  EXPECT_EQ(s.s.did(), "compress 2\n");
}

// Else a topic that fills its link would be compressed for ever.
TEST(TopicOffers, WhatOnlyWaitedBehindOneInVainLeavesAsItIs) {
  OneLink peer;
  Offered s({&peer}, kWhereItPays);
  peer.show_round_trip();
  const Compression how = s.way(peer, 2000);
  for (const char letter : {'x', 'y', 'z'}) s.encode(how, 2000, letter, {&peer});
  EXPECT_EQ(s.s.did(), "compress 1\n");
  s.did_not_shrink();
  EXPECT_EQ(s.s.did(), "");
  EXPECT_EQ(s.subject.bytes(), 0U);
}

// A busy worker makes messages late, too: the time at work counts, not what it computes.
TEST(TopicOffers, AWorkerThatIsSlowerThanThePathIsNotAsked) {
  OneLink peer;
  Offered s({&peer}, kWhereItPays);
  peer.show_round_trip();
  for (int i = 1; i <= 4; ++i) {
    const Compression how = s.way(peer, 2000);
    ASSERT_NE(how, Compression{}) << i;
    s.encode(how, 2000, 'x', {&peer}, 1000 * i);
    s.s.did();
    s.shrunk(100, 1000 * i + (i < 4 ? 0 : 100));  // once 100 ms for what takes the path 3 ms
  }
  EXPECT_EQ(s.way(peer, 2000), Compression{});
}

TEST(TopicOffers, ASampleWaitsUntilItsPathNeedsIt) {
  OneLink peer;
  Offered s({&peer}, kWhereItPays);
  peer.show_round_trip();
  const Compression how = s.way(peer, 100'000);
  s.encode(how, 100'000, 'x', {&peer});
  EXPECT_EQ(s.s.did(), "compress 1\n");
  s.shrunk(30'000);  // 46 ms for this path
  s.encode(how, 100'000, 'y', {&peer});
  EXPECT_EQ(s.s.did(), "");
  EXPECT_EQ(s.subject.bytes(), 100'004U);
  const auto due = s.s.context.timers.deadline();
  ASSERT_TRUE(due);
  EXPECT_GT(*due, ms(130).steady);
  EXPECT_LT(*due, ms(150).steady);
  while (peer.link.connection()->next_packet(ms(140))) {  // it has left earlier than was thought
  }
  std::size_t held = kHeldPerStep;
  s.subject.on_time(held, {*due - Duration(1), 0, 0});
  EXPECT_EQ(s.s.did(), "");
  s.subject.on_time(held, {*due, 0, 0});
  EXPECT_EQ(s.s.did(), "compress 2\n");
}

TEST(TopicOffers, ASmallSampleDoesNotWaitForItsPath) {
  OneLink peer;
  Offered s({&peer}, kWhereItPays);
  peer.show_round_trip();
  const Compression how = s.way(peer, 100'000);
  s.encode(how, 100'000, 'x', {&peer});
  s.encode(how, 500, 'y', {&peer});
  s.s.did();
  s.shrunk(30'000);
  EXPECT_EQ(s.subject.bytes(), 0U);
}

}  // namespace
}  // namespace connect_bridge::topics_test
