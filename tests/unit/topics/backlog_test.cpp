// What is kept for a lost link, by topic and in all.
#include "core/topics/backlog.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <deque>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "unit/topics/one_link.hpp"

namespace connect_bridge::topics_test {
namespace {

constexpr std::size_t kSize = 1000;
constexpr std::uint64_t kNoBound = std::numeric_limits<std::uint64_t>::max();

OutMessage kept_message(std::uint32_t sequence, std::uint32_t origin = 1,
                        std::size_t size = kSize) {
  OutMessage message = flow_test::message(size);
  message.subject = OriginId{origin};
  message.sequence = sequence;
  return message;
}
// What so many of them count.
std::uint64_t bytes_of(std::uint64_t messages) {
  return messages * kept_bytes_of(kept_message(1));
}

Backlog::Options backlog_options() {
  Backlog::Options options;
  options.message_bytes_max = 2 * kSize;
  return options;
}

OutSample sample_of(std::size_t bytes) {
  return {OriginId{1}, 0, 0, Payload::adopt(Bytes(bytes)), {}};
}

struct Kept {
  explicit Kept(std::uint64_t bytes_max = kNoBound, std::uint64_t memory_max = Budget::kNoLimit)
      : memory(memory_max),
        all(std::make_shared<BacklogBound>(peer.link.account, bytes_max), memory) {}

  void add(std::uint32_t sequence, std::uint32_t origin = 1) {
    subject.add(kept_message(sequence, origin));
  }
  // The sequences of what is sent again.
  std::string take(std::uint32_t after) {
    return list_of(subject.take(after), [](const OutMessage& m) { return m.sequence; });
  }
  [[nodiscard]] std::uint64_t dropped(DropReason reason) const {
    return subject.dropped().of(reason);
  }

  OneLink peer;
  Budget memory;
  LinkBacklog all;
  Backlog subject{all, peer.link, backlog_options()};
};

TEST(Backlog, WhatHasArrivedIsNotSentAgain) {
  Kept s;
  for (const std::uint32_t sequence : {4, 5, 6, 0, 0}) s.add(sequence);  // the last: not begun
  EXPECT_EQ(s.take(5), "6 0 0");
  EXPECT_EQ(s.all.resumed(), 3U);
  EXPECT_EQ(s.all.lost(), 0U);
  EXPECT_EQ(s.subject.size(), 0U);
  EXPECT_EQ(s.all.bytes(), 0U);
  EXPECT_EQ(s.memory.used(), 0U);
}

TEST(Backlog, WhatWasNotBegunIsSentWhateverHasArrived) {
  Kept all_arrived;
  for (const std::uint32_t sequence : {4, 5, 0}) all_arrived.add(sequence);
  EXPECT_EQ(all_arrived.take(5), "0");
  Kept none_arrived;
  for (const std::uint32_t sequence : {4, 5, 0}) none_arrived.add(sequence);
  EXPECT_EQ(none_arrived.take(3), "4 5 0");
}

TEST(Backlog, SequencesThatBeginAgainAreBehindTheLastOnes) {
  constexpr std::uint32_t kLast = std::numeric_limits<std::uint32_t>::max();
  Kept s;
  for (const std::uint32_t sequence : {kLast - 1, kLast, std::uint32_t{1}, std::uint32_t{2}})
    s.add(sequence);
  EXPECT_EQ(s.take(kLast), "1 2");
}

// A camera does not displace the messages of a small topic.
TEST(Backlog, BeyondTheBoundTheTopicWithMostDropsItsOldest) {
  Kept s(bytes_of(4));
  Backlog camera{s.all, s.peer.link, backlog_options()};
  s.add(1);
  for (const std::uint32_t sequence : {1, 2, 3}) camera.add(kept_message(sequence));
  EXPECT_EQ(s.all.lost(), 0U);  // it is not beyond it
  s.add(2);
  EXPECT_EQ(camera.dropped().of(DropReason::kResumeBound), 1U);
  EXPECT_EQ(s.dropped(DropReason::kResumeBound), 0U);
  EXPECT_EQ(s.all.lost(), 1U);
  EXPECT_EQ(s.all.bytes(), bytes_of(4));
  EXPECT_EQ(list_of(camera.take(0), [](const OutMessage& m) { return m.sequence; }), "2 3");
  EXPECT_EQ(s.take(0), "1 2");
}

// An identity with many lost links keeps no more than with one.
TEST(Backlog, TheLinksOfAnIdentityHaveOneBound) {
  Kept s(bytes_of(4));
  LinkBacklog of_another{s.all.bound(), s.memory};
  Backlog other{of_another, s.peer.link, backlog_options()};
  for (const std::uint32_t sequence : {1, 2, 3}) other.add(kept_message(sequence));
  s.add(1);
  s.add(2);
  EXPECT_EQ(other.dropped().of(DropReason::kResumeBound), 1U);
  EXPECT_EQ(of_another.lost(), 1U);
  EXPECT_EQ(s.all.lost(), 0U);
  EXPECT_EQ(of_another.bytes() + s.all.bytes(), bytes_of(4));
}

TEST(Backlog, ABoundWithoutRoomForOneMessageKeepsNone) {
  Kept s(bytes_of(1) - 1);
  s.add(1);
  s.add(2);
  EXPECT_EQ(s.subject.size(), 0U);
  EXPECT_EQ(s.all.bytes(), 0U);
  EXPECT_EQ(s.dropped(DropReason::kResumeBound), 2U);
}

TEST(Backlog, TheMemoryOfTheLinkBoundsItToo) {
  Kept s(kNoBound, bytes_of(4));
  for (const std::uint32_t sequence : {1, 2, 3, 4, 5, 6}) s.add(sequence);
  EXPECT_LE(s.memory.used(), bytes_of(4));
  EXPECT_GE(s.subject.size(), 3U);
  EXPECT_EQ(s.subject.size() + s.all.lost(), 6U);
  const auto others = s.memory.hold(bytes_of(4));
  s.add(7);  // without room for any
  EXPECT_EQ(s.subject.size(), 0U);
  EXPECT_EQ(s.all.lost(), 7U);
  EXPECT_EQ(s.memory.used(), others.amount());
}

// A link without memory takes nothing from another link of its identity.
TEST(Backlog, AnotherLinkDoesNotPayForItsMemory) {
  Kept s(kNoBound, bytes_of(2));
  Budget plenty;
  LinkBacklog of_another{s.all.bound(), plenty};
  Backlog other{of_another, s.peer.link, backlog_options()};
  for (std::uint32_t sequence = 1; sequence <= 9; ++sequence) other.add(kept_message(sequence));
  for (const std::uint32_t sequence : {1, 2, 3, 4}) s.add(sequence);
  EXPECT_EQ(other.size(), 9U);
  EXPECT_LE(s.memory.used(), bytes_of(2));
  EXPECT_GT(s.all.lost(), 0U);
  EXPECT_EQ(of_another.lost(), 0U);
}

TEST(Backlog, TheLimitsOfAnOpenLinkHoldForWhatIsKept) {
  Kept s;
  auto options = backlog_options();
  options.rates = RateLimits(1, 0);
  Backlog slow{s.all, s.peer.link, std::move(options)};
  EXPECT_FALSE(slow.admit(sample_of(2 * kSize + 1), ms(0)));
  EXPECT_TRUE(
      slow.admit(sample_of(2 * kSize), ms(0)));  // what is too large does not count for the rate
  EXPECT_FALSE(slow.admit(sample_of(kSize), ms(100)));
  EXPECT_TRUE(slow.admit(sample_of(kSize), ms(1000)));
  EXPECT_EQ(slow.dropped().of(DropReason::kTooLarge), 1U);
  EXPECT_EQ(slow.dropped().of(DropReason::kRate), 1U);
  EXPECT_EQ(s.all.lost(), 2U);
}

TEST(Backlog, TheRateOfEachStateCountsByItself) {
  Kept s;
  auto options = backlog_options();
  options.rates = RateLimits(1, 0);
  Backlog slow{s.all, s.peer.link, std::move(options)};
  OutSample sample = sample_of(kSize);
  for (const std::uint64_t state : {7, 8}) {
    sample.state = state;
    EXPECT_TRUE(slow.admit(sample, ms(0))) << state;
    EXPECT_FALSE(slow.admit(sample, ms(1))) << state;
  }
}

TEST(Backlog, OfAStateOnlyTheNewestIsKept) {
  Kept s;
  const auto add = [&](std::uint32_t sequence, std::uint32_t origin, std::uint64_t state) {
    OutMessage message = kept_message(sequence, origin);
    message.state = state;
    s.subject.add(std::move(message));
  };
  add(4, 1, 7);  // begun: its number is used up
  for (int i = 0; i < 3; ++i) add(0, 1, 7);
  add(0, 1, 8);
  add(0, 2, 7);
  EXPECT_EQ(s.subject.size(), 4U);
  EXPECT_EQ(s.dropped(DropReason::kNewerAvailable), 2U);
  EXPECT_EQ(s.all.lost(), 0U);
  EXPECT_EQ(s.all.bytes(), bytes_of(4));
}

TEST(Backlog, WhatIsClearedIsLostAndHoldsNothing) {
  Kept s;
  s.add(1);
  s.add(2);
  DroppedMessages gone;
  s.subject.clear(DropReason::kWithdrawn, gone, ms(0));
  s.subject.clear(DropReason::kNoDemand, gone, ms(0));
  EXPECT_EQ(s.subject.size(), 0U);
  EXPECT_FALSE(s.subject.holds({1}));
  EXPECT_EQ(s.dropped(DropReason::kWithdrawn), 2U);
  EXPECT_EQ(s.all.lost(), 2U);
  EXPECT_EQ(s.all.bytes(), 0U);
  EXPECT_FALSE(s.all.empty());  // it is there until it is removed
}

// What was begun stays as it is; what waited is replaced by what is newer.
TEST(Backlog, BeginsWithWhatMayNotHaveArrived) {
  Kept s;
  std::deque<OutMessage> unarrived;
  for (const std::uint32_t sequence : {4, 5, 6, 0, 0}) {
    unarrived.push_back(kept_message(sequence, sequence == 0 ? 2 : 1));
    unarrived.back().state = 7;
  }
  s.subject.begin(std::move(unarrived));
  EXPECT_EQ(s.subject.size(), 4U);
  EXPECT_EQ(s.all.bytes(), bytes_of(4));
  EXPECT_EQ(s.dropped(DropReason::kNewerAvailable), 1U);
  EXPECT_TRUE(s.subject.holds({1}));
  OutMessage newer = kept_message(0, 2);
  newer.state = 7;
  s.subject.add(std::move(newer));
  EXPECT_EQ(s.subject.size(), 4U);
  EXPECT_EQ(s.take(4), "5 6 0");
  EXPECT_FALSE(s.subject.holds({1}));
  EXPECT_EQ(s.all.bytes(), 0U);
}

TEST(Backlog, WhatItBeginsWithIsBoundedToo) {
  Kept s(bytes_of(2));
  std::deque<OutMessage> unarrived;
  for (const std::uint32_t sequence : {4, 5, 6})
    unarrived.push_back(kept_message(sequence, sequence));
  s.subject.begin(std::move(unarrived));
  EXPECT_EQ(s.dropped(DropReason::kResumeBound), 1U);
  EXPECT_EQ(s.all.bytes(), bytes_of(2));
  EXPECT_FALSE(s.subject.holds({4}));
  s.add(0, 7);
  EXPECT_EQ(s.dropped(DropReason::kResumeBound), 2U);
  EXPECT_EQ(s.take(3), "6 0");
}

// A hundred thousand take milliseconds.
TEST(Backlog, AStepFreesSomeOfWhatIsDropped) {
  Kept s;
  const auto held = std::make_shared<Bytes>(1);
  const auto shared = [&](std::uint32_t sequence) {
    OutMessage message = kept_message(sequence);
    message.body = Payload::wrap(held, *held);
    return message;
  };
  std::deque<OutMessage> unarrived;
  for (std::uint32_t sequence = 1; sequence <= 20'000; ++sequence)
    unarrived.push_back(shared(sequence));
  s.subject.begin(std::move(unarrived));
  for (int n = 0; n < 20'000; ++n) s.subject.add(shared(0));
  DroppedMessages gone;
  s.subject.clear(DropReason::kResumeBound, gone, ms(5));
  EXPECT_EQ(s.all.bytes(), 0U);
  EXPECT_EQ(s.dropped(DropReason::kResumeBound), 40'000U);
  EXPECT_EQ(gone.deadline(), ms(5).steady);
  gone.free_some();
  EXPECT_EQ(held.use_count(), 1 + 40'000 - 16'384);
  gone.free_some();
  EXPECT_TRUE(gone.deadline());
  gone.free_some();
  EXPECT_EQ(held.use_count(), 1);
  EXPECT_FALSE(gone.deadline());
}

// As long as its origin must stay.
TEST(Backlog, HoldsAnOriginWhileAMessageOfItIsKept) {
  Kept s(bytes_of(2));
  EXPECT_FALSE(s.subject.holds({1}));
  s.add(1, 1);
  s.add(2, 2);
  s.add(3, 2);
  EXPECT_FALSE(s.subject.holds({1}));
  EXPECT_TRUE(s.subject.holds({2}));
  s.add(4, 1);  // drops one of two
  EXPECT_TRUE(s.subject.holds({2}));
  EXPECT_EQ(s.take(3), "4");
  EXPECT_FALSE(s.subject.holds({1}));
  EXPECT_FALSE(s.subject.holds({2}));
}

TEST(Backlog, ATopicThatGoesLeavesTheBoundToTheOthers) {
  Kept s(bytes_of(3));
  std::optional<Backlog> camera;
  camera.emplace(s.all, s.peer.link, backlog_options());
  for (const std::uint32_t sequence : {1, 2, 3}) camera->add(kept_message(sequence));
  camera.reset();
  EXPECT_EQ(s.all.bytes(), 0U);
  EXPECT_EQ(s.memory.used(), 0U);
  for (const std::uint32_t sequence : {1, 2, 3, 4}) s.add(sequence);
  EXPECT_EQ(s.take(0), "2 3 4");
}

}  // namespace
}  // namespace connect_bridge::topics_test
