#include "core/flow/history.hpp"

#include <gtest/gtest.h>

#include <string>

namespace connect_bridge {
namespace {

constexpr OriginId kOne{1};
constexpr OriginId kTwo{2};

Payload sample(std::size_t size) {
  return Payload::adopt(Bytes(size));
}

// "1:10 2:20": origin and stamp in the order a late link gets them.
std::string line_of(const HistoryCache& history) {
  std::string line;
  for (const auto& [origin, stamp, number, payload] : history.samples()) {
    if (!line.empty()) line += ' ';
    line += std::to_string(origin.value) + ":" + std::to_string(stamp);
  }
  return line;
}

TEST(History, KeepsTheLastOfEachOriginInOrderOfArrival) {
  HistoryCache history;
  history.limit(2, 1000);
  history.add({kOne, 1, 0, sample(10)});
  history.add({kTwo, 2, 0, sample(10)});
  history.add({kOne, 3, 0, sample(10)});
  history.add({kOne, 4, 0, sample(10)});
  history.add({kOne, 5, 0, sample(10)});
  EXPECT_EQ(line_of(history), "2:2 1:4 1:5");
  EXPECT_EQ(history.bytes(), 30U);
}

TEST(History, KeepsItsBytesExactly) {
  HistoryCache history;
  history.limit(10, 100);
  history.add({kOne, 1, 0, sample(50)});
  history.add({kTwo, 2, 0, sample(50)});
  EXPECT_EQ(history.bytes(), 100U);
  history.add({kTwo, 3, 0, sample(1)});
  EXPECT_EQ(line_of(history), "2:2 2:3");
  history.add({kTwo, 4, 0, sample(101)});  // can never be kept, and displaces nothing
  EXPECT_EQ(line_of(history), "2:2 2:3");
  history.add({kOne, 5, 0, sample(100)});
  EXPECT_EQ(line_of(history), "1:5");
}

TEST(History, AnOriginTakesItsSamplesWithIt) {
  HistoryCache history;
  history.limit(0, 1000);
  for (Stamp stamp = 1; stamp <= 3; ++stamp) {
    history.add({kOne, stamp, 0, sample(10)});
    history.add({kTwo, stamp, 0, sample(10)});
  }
  history.remove(kOne);
  history.remove(kOne);
  EXPECT_EQ(line_of(history), "2:1 2:2 2:3");
  EXPECT_EQ(history.bytes(), 30U);
  history.clear();
  EXPECT_EQ(line_of(history), "");
  EXPECT_EQ(history.bytes(), 0U);
}

TEST(History, NewLimitsHoldAtOnce) {
  HistoryCache history;
  for (Stamp stamp = 1; stamp <= 5; ++stamp) history.add({kOne, stamp, 0, sample(10)});
  history.limit(3, 1000);
  EXPECT_EQ(line_of(history), "1:3 1:4 1:5");
  history.limit(0, 15);
  EXPECT_EQ(line_of(history), "1:5");
  history.add({kOne, 6, 0, sample(5)});
  EXPECT_EQ(line_of(history), "1:5 1:6");
}

// When others have used up the memory, the oldest is dropped too.
TEST(History, LeavesAsMuchMemoryAsItTakes) {
  Budget memory(8 * kHistoryFloorBytes);
  Budget own(&memory);
  HistoryCache history;
  history.limit(0, 100 * kHistoryFloorBytes);
  history.draw_from(own);
  for (int i = 0; i < 200; ++i) history.add({kOne, i, 0, sample(kHistoryFloorBytes / 10)});
  EXPECT_LE(own.used(), 4 * kHistoryFloorBytes);
  EXPECT_GE(own.used(), 3 * kHistoryFloorBytes);
  EXPECT_EQ(own.used(), history.bytes());
  // Whatever others use, the last ones stay.
  Budget other(&memory);
  const auto greedy = other.hold(8 * kHistoryFloorBytes);
  for (int i = 0; i < 200; ++i) history.add({kOne, i, 0, sample(kHistoryFloorBytes / 10)});
  EXPECT_GT(own.used(), kHistoryFloorBytes * 8 / 10);
  EXPECT_LE(own.used(), kHistoryFloorBytes);
  history.clear();
  EXPECT_EQ(own.used(), 0U);
}

}  // namespace
}  // namespace connect_bridge
