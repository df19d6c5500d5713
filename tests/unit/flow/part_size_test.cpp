#include "core/flow/part_size.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

using std::chrono::milliseconds;

TimePoint at(int ms) {
  return TimePoint(milliseconds(ms));
}

TEST(PartSize, is_not_limited_before_a_measurement) {
  PartSize size;
  size.sent(true, at(0));
  EXPECT_EQ(size.bytes(65536, 65536), 65536U);
}

TEST(PartSize, is_five_milliseconds_of_the_acknowledged_rate) {
  PartSize size;
  size.sent(true, at(0));
  size.acknowledged(25'000, true, at(100));  // 2 Mbit/s
  EXPECT_EQ(size.bytes(65536, 65536), 1250U);
}

TEST(PartSize, follows_the_fastest_of_the_last_intervals) {
  PartSize size;
  size.sent(true, at(0));
  size.acknowledged(100'000, true, at(100));
  size.acknowledged(10'000, true, at(200));
  EXPECT_EQ(size.bytes(65536, 65536), 5000U);
  for (int i = 3; i < 11; ++i) size.acknowledged(50'000, true, at(100 * i));
  EXPECT_EQ(size.bytes(65536, 65536), 2500U);
}

TEST(PartSize, learns_nothing_from_traffic_that_does_not_fill_the_link) {
  PartSize size;
  size.sent(true, at(0));
  size.acknowledged(100, false, at(100));
  EXPECT_EQ(size.bytes(65536, 65536), 65536U);
}

TEST(PartSize, counts_an_interval_from_the_first_packet_after_a_pause) {
  PartSize size;
  size.sent(true, at(0));
  size.acknowledged(100, false, at(10));
  size.sent(true, at(1000));
  size.acknowledged(100'000, true, at(1010));
  EXPECT_EQ(size.bytes(65536, 65536), 50'000U);
}

TEST(PartSize, grows_beyond_the_unproven_size_where_the_link_has_carried_more) {
  PartSize size;
  EXPECT_EQ(size.bytes(500'000, 65536), 65536U);
  size.sent(true, at(0));
  size.acknowledged(100'000, false, at(4));  // though less than the link could carry
  EXPECT_EQ(size.bytes(500'000, 65536), 125'000U);
  size.acknowledged(1'000'000, true, at(6));
  EXPECT_EQ(size.bytes(500'000, 65536), 500'000U);
}

TEST(PartSize, does_not_believe_acknowledgements_that_come_in_a_bunch) {
  PartSize size;
  size.sent(true, at(0));
  size.acknowledged(100'000, true, at(100));  // 1 MB/s
  const auto us = std::chrono::microseconds(1);
  for (int i = 1; i <= 8; ++i) size.acknowledged(10'000, true, at(100) + i * us);
  EXPECT_EQ(size.bytes(500'000, 65536), 65536U);
}

TEST(PartSize, shrinks_again_when_the_link_becomes_slow) {
  PartSize size;
  size.sent(true, at(0));
  for (int i = 1; i <= 8; ++i) size.acknowledged(1'000'000, true, at(5 * i));
  EXPECT_EQ(size.bytes(500'000, 65536), 500'000U);
  for (int i = 1; i <= 8; ++i) size.acknowledged(10'000, true, at(40 + 100 * i));
  EXPECT_EQ(size.bytes(500'000, 65536), PartSize::kPartBytesMin);
}

TEST(PartSize, stays_between_its_bounds) {
  PartSize size;
  size.sent(true, at(0));
  size.acknowledged(1, true, at(1000));
  EXPECT_EQ(size.bytes(65536, 65536), PartSize::kPartBytesMin);
  EXPECT_EQ(size.bytes(100, 65536), 100U);
  size.acknowledged(1'000'000, true, at(1001));
  EXPECT_EQ(size.bytes(65536, 65536), 65536U);
}

}  // namespace
}  // namespace connect_bridge
