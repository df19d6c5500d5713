// More is published on a channel than its link carries: what waits, and what does not.
#include <gtest/gtest.h>

#include <algorithm>
#include <variant>
#include <vector>

#include "core/flow/outbox.hpp"
#include "unit/flow/script.hpp"

namespace connect_bridge::flow_test {
namespace {

constexpr std::size_t kPart = 100'000;
constexpr std::size_t kParts = 5;  // of a message

// A channel on a link that takes a part every so many ms.
class Link {
 public:
  explicit Link(std::int64_t part_ms, std::uint32_t depth = 100)
      : part_ms_(part_ms), outbox_(options()) {
    QueueOptions channel = queue(Priority::kBulk);
    channel.depth = depth;
    channel.burst_bytes_max = 64 << 20;
    outbox_.add_channel(kA, channel);
  }

  // Runs until `ms`; publishes a message at each of these times.
  void run(std::int64_t until, const std::vector<std::int64_t>& publish) {
    auto next = publish.begin();
    for (; now_ < until; ++now_) {
      for (; next != publish.end() && *next == now_; ++next)
        outbox_.push(kA, message(kParts * kPart, at_ms(now_)), now_ms(now_));
      if (now_ % part_ms_ == 0 && !stands_) take();
    }
  }
  void stand(bool stands) { stands_ = stands; }

  // How old each message was when its last part left, ms.
  std::vector<std::int64_t> ages;

 private:
  static OutboxOptions options() {
    OutboxOptions options;
    options.queue_delay_target = {};
    options.fragment_bytes = kPart;
    options.packet_bytes = 1;
    options.unacknowledged_bytes_max = 1 << 30;
    return options;
  }

  void take() {
    const auto sent = outbox_.counts(kA).sent;
    const auto packet = outbox_.next(now_ms(now_));
    if (!packet) return;
    const Bytes bytes = joined(*packet);
    FrameReader reader(bytes);
    const auto frame = reader.next();
    if (const auto* first = std::get_if<MessageFrame>(&*frame.value()))
      published_ = (first->stamp - at_ms(0)) / 1'000'000;
    if (outbox_.counts(kA).sent > sent) ages.push_back(now_ - published_);
  }

  const std::int64_t part_ms_;
  Outbox outbox_;
  std::int64_t now_ = 0;
  std::int64_t published_ = 0;
  bool stands_ = false;
};

std::vector<std::int64_t> every(std::int64_t period, std::int64_t from, std::int64_t until) {
  std::vector<std::int64_t> times;
  for (std::int64_t ms = from; ms < until; ms += period) times.push_back(ms);
  return times;
}

TEST(Overload, OnlyTheNewestWaits) {
  Link link(44);  // 220 ms for a message
  link.run(10'000, every(100, 0, 10'000));
  ASSERT_GT(link.ages.size(), 43U);  // the link never rests
  const std::vector<std::int64_t> later(link.ages.begin() + 8, link.ages.end());
  EXPECT_LE(*std::max_element(later.begin(), later.end()), 100 + 44 + 220);
}

TEST(Overload, ABurstArrivesWhole) {
  Link link(44);  // 220 ms for a message
  link.run(5'000, {0, 10});
  EXPECT_EQ(link.ages.size(), 2U);
  link.run(10'000, {5'000, 5'010, 5'020});  // one is under way, two wait
  EXPECT_EQ(link.ages.size(), 5U);
}

TEST(Overload, BurstsLoseOnlyWhatDoesNotFit) {
  Link link(44, 5);
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

TEST(Overload, AStandingPathIsNotASlowOne) {
  Link link(10);  // 50 ms for a message
  link.run(3'010, every(300, 0, 3'010));
  link.stand(true);  // the last one is under way
  link.run(4'500, every(300, 3'200, 4'500));
  link.stand(false);
  const auto before = link.ages.size();
  link.run(4'560, {});
  link.run(5'000, {4'560});
  EXPECT_EQ(link.ages.size(), before + 4);  // that one, and what there was room for
}

}  // namespace
}  // namespace connect_bridge::flow_test
