// Origins of a topic that have no mirror, as there are too many.
#include "core/mirrors/left_out_origins.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <string>

#include "unit/side/words.hpp"

namespace connect_bridge::side_test {
namespace {

struct LeftOut {
  void add(std::uint32_t id, const std::string& node = "") {
    OriginOffer left = origin(id, static_cast<std::uint8_t>(id));
    left.node = node;
    subject.add(left, memory);
  }
  // The one that is taken out; 0: none.
  std::uint32_t take(bool has_place = true) {
    const auto taken = subject.take([&](const OriginOffer&) { return has_place; });
    return taken ? taken->origin.value : 0;
  }

  Budget memory{100'000};
  LeftOutOrigins subject;
};

TEST(LeftOutOrigins, ComeInTheirOrderWhenThereIsAPlace) {
  LeftOut s;
  s.add(2);
  s.add(1);
  EXPECT_EQ(s.take(false), 0U);
  EXPECT_EQ(s.subject.size(), 2U);
  EXPECT_EQ(s.take(), 1U);
  EXPECT_EQ(s.take(), 2U);
  EXPECT_EQ(s.take(), 0U);
}

TEST(LeftOutOrigins, OneThatIsOfferedNoLongerWaitsForNothing) {
  LeftOut s;
  s.add(1);
  s.add(2);
  s.subject.remove({1});
  s.subject.remove({7});
  EXPECT_FALSE(s.subject.contains({1}));
  EXPECT_TRUE(s.subject.contains({2}));
  EXPECT_EQ(s.take(), 2U);
}

// A peer may tell a thousand of them on each of its channels, with long names.
TEST(LeftOutOrigins, CostMemoryWithTheNamesOfTheirNodes) {
  LeftOut s;
  s.add(1);
  const std::uint64_t one = s.memory.used();
  EXPECT_GT(one, 0U);
  s.add(2, std::string(200, 'n'));
  EXPECT_EQ(s.memory.used(), 2 * one + 200);
  s.add(1);  // twice
  EXPECT_EQ(s.memory.used(), 2 * one + 200);
  s.subject.remove({1});
  EXPECT_EQ(s.memory.used(), one + 200);
  EXPECT_EQ(s.take(), 2U);
  EXPECT_EQ(s.memory.used(), 0U);
}

TEST(LeftOutOrigins, WithoutRoomNoMoreAreRemembered) {
  LeftOut s;
  s.add(1);
  const std::uint64_t one = s.memory.used();
  auto others = s.memory.hold(s.memory.room() - one + 1);
  s.add(2);
  EXPECT_FALSE(s.subject.contains({2}));
  EXPECT_EQ(s.subject.size(), 1U);
  others.resize(others.amount() - 1);
  s.add(2);
  EXPECT_TRUE(s.subject.contains({2}));
}

}  // namespace
}  // namespace connect_bridge::side_test
