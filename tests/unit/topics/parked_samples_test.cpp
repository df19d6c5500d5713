// Samples that come before the graph shows their publisher.
#include "core/topics/parked_samples.hpp"

#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <string>

#include "unit/topics/one_link.hpp"

namespace connect_bridge::topics_test {
namespace {

struct Parks {
  bool add(std::uint8_t publisher, const std::string& text, std::int64_t at = 0) {
    return subject.add({{}, gid(publisher), 0, sample(text), 0}, all, ms(at));
  }
  void know(std::uint8_t publisher) { known[gid(publisher)] = publisher; }
  // "a -b": a crosses, b is dropped.
  std::string review(std::int64_t at) {
    std::string words;
    const auto say = [&](const std::string& before, const MessageTaken& taken) {
      words += (words.empty() ? "" : " ") + before + text_of(taken.payload.view());
    };
    subject.review(
        ms(at),
        [&](const Gid& origin) {
          const auto found = known.find(origin);
          return found == known.end() ? nullptr : &found->second;
        },
        [&](std::uint8_t& publisher, MessageTaken taken, TimePoint) {
          EXPECT_EQ(taken.origin, gid(publisher));
          say("", taken);
        },
        [&](const MessageTaken& taken) { say("-", taken); });
    return words;
  }
  std::optional<TimePoint> deadline() const { return timers.deadline(); }

  Budget all;
  ExportTimers timers;
  std::map<Gid, std::uint8_t> known;
  ParkedSamples subject{{timers, nullptr}};
};

TEST(ParkedSamples, WaitUntilTheirPublisherIsKnown) {
  Parks s;
  EXPECT_TRUE(s.add(1, "a"));
  EXPECT_EQ(s.review(100), "");
  EXPECT_TRUE(s.subject.has(gid(1)));
  EXPECT_FALSE(s.subject.has(gid(2)));
  s.know(1);
  EXPECT_EQ(s.review(200), "a");
  EXPECT_TRUE(s.subject.empty());
  EXPECT_EQ(s.review(300), "");  // once
}

TEST(ParkedSamples, CrossInTheirOrderWhoeverElseWaits) {
  Parks s;
  for (const auto* text : {"a", "b", "c"})
    for (const std::uint8_t publisher : {1, 2})
      EXPECT_TRUE(s.add(publisher, text + std::to_string(publisher)));
  s.know(2);
  EXPECT_EQ(s.review(100), "a2 b2 c2");
  EXPECT_FALSE(s.subject.has(gid(2)));
  EXPECT_TRUE(s.add(1, "d1", 100));
  s.know(1);
  EXPECT_EQ(s.review(200), "a1 b1 c1 d1");
}

// It was another bridge's mirror, or its publisher is gone.
TEST(ParkedSamples, NeverCrossWithoutAPublisher) {
  Parks s;
  EXPECT_TRUE(s.add(1, "a"));
  EXPECT_TRUE(s.add(1, "b", 500));
  EXPECT_EQ(s.review(999), "");
  EXPECT_EQ(s.review(1000), "-a");
  s.know(1);
  EXPECT_EQ(s.review(1400), "b");
}

TEST(ParkedSamples, CrossAtTheLastMoment) {
  Parks s;
  EXPECT_TRUE(s.add(1, "a"));
  s.know(1);
  EXPECT_EQ(s.review(1000), "a");
}

TEST(ParkedSamples, AreLookedAtWhenTheOldestHasWaitedForItsTime) {
  Parks s;
  EXPECT_FALSE(s.deadline());
  EXPECT_TRUE(s.add(1, "a"));
  EXPECT_TRUE(s.add(2, "b", 300));
  EXPECT_EQ(s.deadline(), ms(1000).steady);
  s.know(1);
  EXPECT_EQ(s.review(400), "a");
  EXPECT_EQ(s.deadline(), ms(1300).steady);
  EXPECT_EQ(s.review(1300), "-b");
  EXPECT_FALSE(s.deadline());
}

// The graph that was asked for comes then.
TEST(ParkedSamples, AreNotLookedAtBeforeTheTimeThatIsSet) {
  Parks s;
  EXPECT_TRUE(s.add(1, "a"));
  s.subject.wait_until(ms(1500).steady);
  EXPECT_TRUE(s.add(1, "b", 900));
  EXPECT_EQ(s.deadline(), ms(1500).steady);
  EXPECT_EQ(s.review(1500), "-a");
  EXPECT_EQ(s.deadline(), ms(1900).steady);
}

TEST(ParkedSamples, OfATopicAreAtMostSoMany) {
  Parks s;
  for (std::size_t i = 0; i < ParkedSamples::kSamplesMax; ++i) EXPECT_TRUE(s.add(1, "x"));
  const std::uint64_t used = s.all.used();
  EXPECT_FALSE(s.add(1, "late"));
  EXPECT_EQ(s.all.used(), used);
  s.know(1);
  EXPECT_EQ(s.review(100).find("late"), std::string::npos);
  EXPECT_TRUE(s.add(1, "next", 100));
}

TEST(ParkedSamples, OfAllTopicsHaveAtMostSoManyBytes) {
  Parks s;
  auto others = s.all.hold(ParkedSamples::kBytesMax);
  EXPECT_FALSE(s.add(1, "a"));
  EXPECT_TRUE(s.subject.empty());
  others.release();
  EXPECT_TRUE(s.add(1, "b"));
  EXPECT_EQ(s.all.used(), sample("b").size());
  s.know(1);
  EXPECT_EQ(s.review(100), "b");
  EXPECT_EQ(s.all.used(), 0U);
}

TEST(ParkedSamples, HoldNothingAfterTheyWereDropped) {
  Parks s;
  EXPECT_TRUE(s.add(1, "a"));
  EXPECT_EQ(s.review(1000), "-a");
  EXPECT_EQ(s.all.used(), 0U);
  EXPECT_TRUE(s.add(1, "b", 1100));
  s.subject.clear();
  EXPECT_TRUE(s.subject.empty());
  EXPECT_EQ(s.all.used(), 0U);
  EXPECT_FALSE(s.deadline());
  EXPECT_EQ(s.review(5000), "");
}

}  // namespace
}  // namespace connect_bridge::topics_test
