// More is published on a channel than its link carries: what waits, and what does not.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <utility>
#include <variant>
#include <vector>

#include "core/flow/outbox.hpp"
#include "unit/flow/script.hpp"

namespace connect_bridge::flow_test {
namespace {

constexpr std::size_t kPart = 100'000;
constexpr std::size_t kParts = 5;  // of a message

enum class Of : std::uint8_t { kState, kEvents };

// A channel on a link that takes a part every so many ms.
class Link {
 public:
  explicit Link(std::int64_t part_ms, Of of = Of::kState, std::uint32_t depth = 100,
                std::uint64_t bytes_max = 1 << 30)
      : part_ms_(part_ms), what_(of), outbox_(options()) {
    QueueOptions channel = queue(Priority::kBulk);
    channel.depth = depth;
    channel.queue_bytes_max = bytes_max;
    outbox_.add_channel(kA, channel);
  }

  // Runs until `ms`; publisher 1 publishes a message at each of these times, 2 at the others.
  void run(std::int64_t until, const std::vector<std::int64_t>& publish,
           const std::vector<std::int64_t>& other = {}) {
    for (; now_ < until; ++now_) {
      publish_at(publish, {1});
      publish_at(other, {2});
      if (now_ % part_ms_ == 0 && !stands_) take();
    }
  }
  // Of so many publishers each publishes once in `period`, one after the other. How many messages
  // of each leave from `from` to `until`.
  std::vector<std::size_t> run_together(std::uint32_t publishers, std::int64_t period,
                                        std::int64_t from, std::int64_t until) {
    for (; now_ < until; ++now_) {
      if (now_ == from) left_.clear();
      for (std::uint32_t i = 0; i < publishers; ++i)
        if (now_ % period == period * i / publishers) publish({i + 1});
      if (now_ % part_ms_ == 0) take();
    }
    std::vector<std::size_t> each;
    for (std::uint32_t i = 0; i < publishers; ++i) each.push_back(left_[{i + 1}]);
    return each;
  }
  void stand(bool stands) { stands_ = stands; }
  [[nodiscard]] std::uint64_t dropped(DropReason reason) {
    return outbox_.counts(kA).dropped.of(reason);
  }

  // How old each message was when its last part left, ms: of publisher 1, of publisher 2.
  std::vector<std::int64_t> ages;
  std::vector<std::int64_t> other_ages;

 private:
  static OutboxOptions options() {
    OutboxOptions options;
    options.queue_delay_target = {};
    options.fragment_bytes = kPart;
    options.packet_bytes = 1;
    options.data_bytes_max = 1ULL << 40;
    options.unacknowledged_bytes_max = 1ULL << 40;
    return options;
  }

  void publish_at(const std::vector<std::int64_t>& times, OriginId publisher) {
    for (auto count = std::count(times.begin(), times.end(), now_); count > 0; --count)
      publish(publisher);
  }
  void publish(OriginId publisher) {
    OutMessage next = message(kParts * kPart, at_ms(now_));
    next.subject = publisher;
    if (what_ == Of::kState) next.state = 0;
    outbox_.push(kA, std::move(next), now_ms(now_));
  }

  void take() {
    const auto sent = outbox_.counts(kA).sent;
    const auto packet = outbox_.next(now_ms(now_));
    if (!packet) return;
    const Bytes bytes = joined(*packet);
    FrameReader reader(bytes);
    const auto frame = reader.next();
    if (const auto* first = std::get_if<MessageFrame>(&*frame.value())) {
      published_ = (first->stamp - at_ms(0)) / 1'000'000;
      of_ = first->subject.origin();
    }
    if (outbox_.counts(kA).sent == sent) return;
    ++left_[of_];
    (of_ == OriginId{2} ? other_ages : ages).push_back(now_ - published_);
  }

  const std::int64_t part_ms_;
  const Of what_;
  Outbox outbox_;
  std::int64_t now_ = 0;
  std::int64_t published_ = 0;
  OriginId of_{};  // what leaves
  std::map<OriginId, std::size_t> left_;
  bool stands_ = false;
};

std::vector<std::int64_t> every(std::int64_t period, std::int64_t from, std::int64_t until) {
  std::vector<std::int64_t> times;
  for (std::int64_t ms = from; ms < until; ms += period) times.push_back(ms);
  return times;
}

std::int64_t oldest_after(const std::vector<std::int64_t>& ages, std::size_t first) {
  return *std::max_element(ages.begin() + static_cast<std::ptrdiff_t>(first), ages.end());
}

// A message takes 200 ms. What arrives is about as old as two of them, however much more than the
// link carries is published; and as many arrive as the link carries.
TEST(Overload, WhatArrivesIsNowHoweverSmallTheOverloadIs) {
  for (const std::int64_t period : {20, 100, 133, 188, 198}) {
    Link link(40);
    link.run(30'000, every(period, 0, 30'000));
    EXPECT_GE(link.ages.size(), 148U) << period;
    EXPECT_LE(oldest_after(link.ages, 15), 3 * 200 + 100) << period;
  }
}

TEST(Overload, APublisherSlowerThanTheLinkIsNeverThinned) {
  Link link(40);
  link.run(30'000, every(205, 0, 29'000));
  EXPECT_EQ(link.dropped(DropReason::kNewerAvailable), 0U);
}

// However fast the other one is; neither does the fast one starve.
TEST(Overload, PublishersOfOneTopicTakeTurns) {
  Link link(40);
  link.run(30'000, every(20, 0, 30'000), every(1000, 7, 29'000));
  EXPECT_EQ(link.other_ages.size(), 29U);
  EXPECT_GE(link.ages.size(), 115U);
  Link both(40);
  both.run(30'000, every(20, 0, 30'000), every(30, 0, 30'000));
  EXPECT_NEAR(static_cast<double>(both.ages.size()), static_cast<double>(both.other_ages.size()),
              4);
  EXPECT_LE(oldest_after(both.ages, 15), 900);
}

// Their periods are equal, so who finds the link free once would find it so always: also where
// depth or bytes drop something before the queue stands.
TEST(Overload, NoPublisherOfATopicStarves) {
  const std::uint64_t few = 6 * kParts * kPart;
  for (const auto& [depth, bytes_max] : {std::pair{1U, std::uint64_t{1} << 30}, {100U, few}}) {
    for (const std::int64_t period : {10, 20}) {  // the link takes a message in 10 ms
      Link link(2, Of::kState, depth, bytes_max);
      const auto each = link.run_together(3, period, 3'000, 15'000);
      const auto [least, most] = std::minmax_element(each.begin(), each.end());
      EXPECT_LE(*most, *least * 3) << depth << ' ' << period;
    }
  }
}

TEST(Overload, ABurstArrivesWhole) {
  Link link(4);  // 20 ms for a message
  link.run(5'000, std::vector<std::int64_t>(100, 0));
  EXPECT_EQ(link.ages.size(), 100U);
  link.run(10'000, every(1, 6'000, 6'100));
  EXPECT_EQ(link.ages.size(), 200U);
}

TEST(Overload, BurstsLoseOnlyWhatDoesNotFit) {
  Link link(44, Of::kState, 5);
  for (const int start : {0, 5'000, 10'000}) {
    link.ages.clear();
    const int later = start + 60;  // the first is under way
    link.run(start + 5'000, {start, later, later, later, later, later, later, later});
    EXPECT_EQ(link.ages.size(), 6U);
  }
}

TEST(Overload, EndsWhenTheLinkKeepsUp) {
  Link link(44);  // 220 ms for a message
  link.run(5'000, every(100, 0, 4'000));
  const auto before = link.ages.size();
  link.run(10'000, {5'000, 5'010, 5'020});
  EXPECT_EQ(link.ages.size(), before + 3);
}

TEST(Overload, AfterAPathThatStoodWhatIsNowComesFirst) {
  Link link(10);  // 50 ms for a message
  link.run(3'010, every(300, 0, 3'010));
  link.stand(true);  // the last one is under way
  link.run(6'000, every(300, 3'200, 6'000));
  link.stand(false);
  const auto before = link.ages.size();
  link.run(6'200, {});
  ASSERT_EQ(link.ages.size(), before + 2);  // that one, and the newest
  EXPECT_LE(link.ages.back(), 300 + 100);
}

// It has room for one of each: nothing waits for long, and each has its turn all the same.
TEST(Overload, PublishersOfOneTopicTakeTurnsHoweverShortItsQueueIs) {
  Link link(40, Of::kState, 2);  // 200 ms for a message
  link.run(30'000, every(20, 0, 30'000), every(20, 10, 30'000));
  EXPECT_NEAR(static_cast<double>(link.ages.size()), static_cast<double>(link.other_ages.size()),
              4);
}

// It may be the stop. It is new, however long others have waited in its place.
TEST(Overload, WhatHasDisplacedAnOlderOneHasNotWaitedForIt) {
  Link link(1200, Of::kEvents, 2);  // 6 s for a message
  link.run(60'000, every(1000, 0, 60'000), every(1000, 500, 60'000));
  EXPECT_EQ(link.dropped(DropReason::kQueueTime), 0U);
  EXPECT_LE(oldest_after(link.ages, 1), 6'000 + 6'000 + 1'000);
}

// Of a publisher that keeps all, too (depth 0).
class EachOneWaits : public testing::TestWithParam<std::uint32_t> {};
INSTANTIATE_TEST_SUITE_P(Overload, EachOneWaits, testing::Values(1'000'000U, 0U));

TEST_P(EachOneWaits, ForFiveSeconds) {
  Link link(40, Of::kEvents, GetParam());  // 200 ms for a message
  link.run(4'000, every(100, 0, 4'000));
  EXPECT_EQ(link.ages.size(), 20U);
  EXPECT_EQ(link.dropped(DropReason::kQueueTime), 0U);
  link.run(30'000, every(100, 4'000, 30'000));
  EXPECT_GT(link.dropped(DropReason::kQueueTime), 0U);
  EXPECT_LE(oldest_after(link.ages, 0), 5'000 + 200 + 200);
  EXPECT_GE(link.ages.size(), 148U);
  // What is over is sent whole.
  const auto before = link.ages.size();
  const auto dropped = link.dropped(DropReason::kQueueTime);
  link.run(50'000, {});
  EXPECT_GE(link.ages.size(), before + 24);
  EXPECT_EQ(link.dropped(DropReason::kQueueTime), dropped);
}

// ---- a queue that depth bounds

OutMessage of_publisher(OriginId publisher, std::size_t size) {
  OutMessage next = message(size);
  next.subject = publisher;
  return next;
}

// Where its publisher's own oldest leaves too little room, the oldest of all gives way.
TEST(OutboxDepth, BytesBoundAQueueThatDepthHasFilled) {
  Outbox outbox(one_by_one());
  auto options = queue(Priority::kNormal);
  options.depth = 2;
  options.queue_bytes_max = 100;
  outbox.add_channel(kA, options);
  for (const std::uint32_t publisher : {1U, 2U})
    outbox.push(kA, of_publisher({publisher}, 10), now_ms(0));
  outbox.push(kA, of_publisher({1}, 90), now_ms(0));
  EXPECT_EQ(outbox.counts(kA).queued_bytes, 100U);
  outbox.push(kA, of_publisher({2}, 20), now_ms(0));
  EXPECT_EQ(outbox.counts(kA).queued_bytes, 30U);
  expect_balance(outbox.counts(kA));
}

TEST(OutboxDepth, WhatTakesAnOlderOnesPlaceHasWaitedSinceItCame) {
  Outbox outbox(one_by_one());
  auto options = queue(Priority::kNormal);
  options.depth = 3;
  const ChannelQueue& channel = outbox.add_channel(kA, options);
  outbox.push(kA, of_publisher({1}, 11), now_ms(0));
  outbox.push(kA, of_publisher({2}, 12), now_ms(0));
  outbox.push(kA, of_publisher({1}, 13), now_ms(2000));
  outbox.push(kA, of_publisher({1}, 14), now_ms(3000));
  EXPECT_EQ(next(outbox, now_ms(3010)), "1#1:13");
  EXPECT_EQ(channel.last_wait(), std::chrono::milliseconds(1010));
  next(outbox, now_ms(3010));
  EXPECT_EQ(channel.last_wait(), std::chrono::milliseconds(3010));
  EXPECT_EQ(next(outbox, now_ms(3010)), "1#3:14");
  EXPECT_EQ(channel.last_wait(), std::chrono::milliseconds(10));
}

}  // namespace
}  // namespace connect_bridge::flow_test
