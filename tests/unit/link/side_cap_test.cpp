// One limit for the bytes of all links of a side.
#include "core/link/side_cap.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <list>

#include "core/flow/link_cap.hpp"

namespace connect_bridge {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;
using namespace std::chrono_literals;

constexpr double kMore = std::numeric_limits<double>::infinity();
constexpr std::uint64_t kRate = 20'000;
constexpr TimePoint kStart{100s};

TEST(FairLevel, WhoWantsLessLeavesTheRestToTheOthers) {
  EXPECT_EQ(fair_level(90, {kMore, kMore, kMore}), 30);
  EXPECT_EQ(fair_level(90, {10, kMore, kMore}), 40);
  EXPECT_EQ(fair_level(90, {kMore, 20, 10}), 60);
  EXPECT_EQ(fair_level(90, {10, 20}), 90);
  EXPECT_EQ(fair_level(90, {}), 90);
}

// Links that send messages of 500 bytes through their caps.
class Senders {
 public:
  explicit Senders(std::uint64_t rate) : cap_(rate) {}

  // `per_second`: messages that it would send. Urgent ones are not held back.
  void add(const void* identity, double per_second = kMore, bool urgent = false) {
    links_.push_back({identity, per_second, urgent, LinkCap(kRate), 0, 0});
  }
  void run(Duration time) {
    for (const TimePoint end = now_ + time; now_ < end; now_ += 1ms) {
      for (Link& link : links_) send(link);
      if (cap_.deadline() && *cap_.deadline() <= now_) divide();
    }
  }
  void counted(std::uint64_t bytes) { cap_.counted(bytes, now_); }
  // Bytes that left since the last call, of each link.
  std::vector<std::uint64_t> take() {
    std::vector<std::uint64_t> all;
    for (Link& link : links_) all.push_back(std::exchange(link.left, 0));
    return all;
  }
  std::uint64_t take_sum() {
    std::uint64_t sum = 0;
    for (const auto each : take()) sum += each;
    return sum;
  }
  [[nodiscard]] bool rests() const { return !cap_.deadline(); }
  void stop() {
    for (Link& link : links_) link.per_second = link.waiting = 0;
  }

 private:
  struct Link {
    const void* identity;
    double per_second;
    bool urgent;
    LinkCap cap;
    double waiting;  // messages
    std::uint64_t left;
  };

  void send(Link& link) {
    link.waiting = std::min(link.waiting + link.per_second / 1000, 1000.0);
    while (link.waiting >= 1 && (link.urgent || !link.cap.holds(now_))) {
      --link.waiting;
      link.cap.sent(500, now_);
      link.left += LinkCap::cost(500);
      cap_.sent(now_, LinkCap::cost(500));
    }
  }
  void divide() {
    std::vector<SideCap::Use> uses;
    for (Link& link : links_)
      uses.push_back({link.identity, link.cap.take_sent(), link.waiting >= 1 && !link.urgent});
    const auto rates = cap_.divide(uses, now_);
    auto rate = rates.begin();
    for (Link& link : links_) link.cap.set_rate(*rate++, now_);
  }

  SideCap cap_;
  std::list<Link> links_;
  TimePoint now_ = kStart;
};

const int kAnna = 0;
const int kBert = 0;

TEST(SideCap, ManyLinksHaveOneLimit) {
  Senders s(kRate);
  for (int i = 0; i < 16; ++i) s.add(&kAnna);
  s.run(10s);
  // The first period is not known to be full before it ends; ten seconds pay for it.
  EXPECT_NEAR(static_cast<double>(s.take_sum()), 10.0 * kRate, 0.05 * 10 * kRate);
  s.run(10s);
  EXPECT_NEAR(static_cast<double>(s.take_sum()), 10.0 * kRate, 0.05 * 10 * kRate);
}

TEST(SideCap, AnIdentityWithManyLinksHasOneShare) {
  Senders s(kRate);
  s.add(&kBert);
  for (int i = 0; i < 15; ++i) s.add(&kAnna);
  s.run(5s);
  s.take();
  s.run(10s);
  const auto left = s.take();
  EXPECT_NEAR(static_cast<double>(left[0]), 5.0 * kRate, 0.1 * 5 * kRate);
}

TEST(SideCap, AShareThatIsNotNeededIsForOthers) {
  Senders s(kRate);
  s.add(&kBert, 2);
  s.add(&kAnna);
  s.run(2s);
  s.take();
  s.run(10s);
  const auto left = s.take();
  EXPECT_NEAR(static_cast<double>(left[0]), 20.0 * static_cast<double>(LinkCap::cost(500)), 700);
  EXPECT_GT(left[1], 10 * kRate * 9 / 10 - left[0]);
}

TEST(SideCap, UrgentMessagesAreTakenFromTheRest) {
  Senders s(kRate);
  s.add(&kBert, 16, true);  // nearly half of the limit
  s.add(&kAnna);
  s.run(2s);
  s.take();
  s.run(10s);
  const auto left = s.take();
  EXPECT_NEAR(static_cast<double>(left[0]), 160.0 * static_cast<double>(LinkCap::cost(500)), 700);
  EXPECT_NEAR(static_cast<double>(left[0] + left[1]), 10.0 * kRate, 0.06 * 10 * kRate);
}

// Bytes that a link which has always more to send sends in the last 20 of so many seconds, while
// each second so many bytes are of no link.
double sent_beside(std::uint64_t others, int seconds) {
  Senders s(kRate);
  s.add(&kAnna);
  s.run(2s);
  s.take();
  std::uint64_t sent = 1'000'000;
  std::uint64_t links = 0;
  for (int second = 0; second < seconds; ++second) {
    s.counted(sent);
    s.run(1s);
    const auto now = s.take_sum();
    if (second >= seconds - 20) links += now;
    sent += now + others;
  }
  return static_cast<double>(links);
}

TEST(SideCap, BytesOfNoLinkCountToo) {
  EXPECT_NEAR(sent_beside(kRate / 2, 20), 10.0 * kRate, 0.15 * 10 * kRate);
}

// A stranger causes as many of them as it likes.
TEST(SideCap, BytesOfNoLinkTakeAtMostHalf) {
  EXPECT_NEAR(sent_beside(5 * kRate, 40), 10.0 * kRate, 0.15 * 10 * kRate);
}

TEST(SideCap, SomethingFlowsWhateverIsOwed) {
  Senders s(kRate);
  s.add(&kBert, 500, true);
  s.add(&kAnna);
  s.run(5s);
  s.take();
  s.run(10s);
  // A half of the twentieth: the other identity has the same share.
  EXPECT_GT(s.take()[1], 10 * kRate / 50);
}

TEST(SideCap, ASideThatSendsNothingHasNoTimer) {
  Senders s(kRate);
  s.add(&kAnna);
  EXPECT_TRUE(s.rests());
  s.run(1s);
  EXPECT_FALSE(s.rests());
  s.stop();
  s.run(12s);
  EXPECT_TRUE(s.rests());
}

TEST(SideCap, NoLimitDividesNothing) {
  SideCap cap(0);
  cap.sent(kStart, 0);
  EXPECT_FALSE(cap.limits());
  EXPECT_FALSE(cap.deadline());
}

TEST(SideCap, ALimitThatChangesKeepsWhatIsOwed) {
  SideCap cap(kRate);
  cap.sent(kStart, 0);
  const auto before = cap.divide({{&kAnna, 5 * kRate, true}}, kStart + 1s);
  EXPECT_THAT(before, ElementsAre(DoubleNear(kRate * SideCap::kLeast, 1)));
  cap.set(2 * kRate);
  // Of the 80,000 bytes that were owed 40,000 are paid.
  const auto after = cap.divide({{&kAnna, 0, true}}, kStart + 2s);
  EXPECT_THAT(after, ElementsAre(DoubleNear(2 * kRate * SideCap::kLeast, 1)));
  const auto paid = cap.divide({{&kAnna, 0, true}}, kStart + 3s);
  EXPECT_THAT(paid, ElementsAre(DoubleNear(2 * kRate, 1)));
}

TEST(SideCap, ALimitThatBeginsFindsNothingOwed) {
  SideCap cap(0);
  cap.counted(1'000'000, kStart);
  cap.set(kRate);
  const auto first = cap.divide({{&kAnna, 0, true}}, kStart);
  EXPECT_THAT(first, ElementsAre(DoubleNear(kRate, 1)));
  cap.set(0);
  (void)cap.divide({{&kAnna, 50 * kRate, true}}, kStart + 1s);
  cap.counted(50'000'000, kStart + 1s);
  cap.set(kRate);
  cap.counted(60'000'000, kStart + 2s);  // the first number says nothing
  const auto again = cap.divide({{&kAnna, 0, true}}, kStart + 2s);
  EXPECT_THAT(again, ElementsAre(DoubleNear(kRate, 1)));
}

// A link that opens ends the period at once.
TEST(SideCap, AShortPeriodPaysForItsOwnTimeAlone) {
  SideCap cap(kRate);
  cap.sent(kStart, 0);
  std::vector<double> rates;
  for (int i = 0; i < 100; ++i) rates = cap.divide({{&kAnna, 0, true}}, kStart);
  EXPECT_THAT(rates, ElementsAre(DoubleNear(kRate, 1)));
}

TEST(SideCap, IdleLinksThatSendTogetherEndThePeriod) {
  SideCap cap(kRate);
  cap.sent(kStart, kRate / 10);
  EXPECT_EQ(cap.deadline(), kStart + SideCap::kPeriod);
  cap.sent(kStart + 1ms, 1);
  EXPECT_EQ(cap.deadline(), kStart + 10ms);
  cap.sent(kStart + 20ms, 1);
  EXPECT_EQ(cap.deadline(), kStart + 10ms);
}

}  // namespace
}  // namespace connect_bridge
