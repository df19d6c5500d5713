#include "core/link/published.hpp"

#include <gtest/gtest.h>

#include "unit/side/words.hpp"

namespace connect_bridge {
namespace {

using side_test::gid;

Published::Origin origin_of(std::uint8_t publisher) {
  return {{"/map", "nav_msgs/msg/OccupancyGrid"}, gid(publisher)};
}

TEST(Published, EachOriginIsTakenOnce) {
  Budget memory;
  Published published;
  published.note(origin_of(1), {7, {gid(50), gid(51)}}, memory);
  published.note(origin_of(2), {8, {gid(50)}}, memory);
  EXPECT_GT(memory.used(), 0U);
  const auto taken = published.take(origin_of(1));
  EXPECT_EQ(taken.number, 7U);
  EXPECT_EQ(taken.subscribers, (std::set<Gid>{gid(50), gid(51)}));
  EXPECT_EQ(published.take(origin_of(1)).number, 0U);
  EXPECT_FALSE(published.empty());
  published.clear();
  EXPECT_TRUE(published.empty());
  EXPECT_EQ(memory.used(), 0U);
}

// Nobody got them: whoever comes needs them.
TEST(Published, SamplesWithoutASubscriberAreNotNoted) {
  Budget memory;
  Published published;
  published.note(origin_of(1), {7, {}}, memory);
  EXPECT_TRUE(published.empty());
}

TEST(Published, OriginsSubscribersAndMemoryAreLimited) {
  Budget memory(4000);
  Published published;
  std::set<Gid> many;
  for (std::uint8_t n = 0; n <= Published::kSubscribersMax; ++n) many.insert(gid(n));
  published.note(origin_of(1), {7, many}, memory);
  EXPECT_TRUE(published.empty());
  for (std::uint8_t n = 1; n < 200; ++n) published.note(origin_of(n), {7, {gid(50)}}, memory);
  EXPECT_LE(memory.used(), 4000U);
  EXPECT_EQ(published.take(origin_of(1)).number, 7U);
  EXPECT_EQ(published.take(origin_of(199)).number, 0U);

  Budget enough;
  Published most;
  for (std::size_t i = 0; i < Published::kOriginsMax + 10; ++i)
    most.note({{"/map" + std::to_string(i), "t"}, gid(1)}, {7, {gid(50)}}, enough);
  std::size_t noted = 0;
  for (std::size_t i = 0; i < Published::kOriginsMax + 10; ++i)
    noted += most.take({{"/map" + std::to_string(i), "t"}, gid(1)}).number != 0 ? 1 : 0;
  EXPECT_EQ(noted, Published::kOriginsMax);
}

}  // namespace
}  // namespace connect_bridge
