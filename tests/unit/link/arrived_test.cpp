#include "core/link/arrived.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

Gid numbered_gid(std::size_t n) {
  Gid gid;
  gid.bytes[0] = static_cast<std::uint8_t>(n);
  gid.bytes[1] = static_cast<std::uint8_t>(n >> 8);
  return gid;
}

TEST(Arrived, OriginsDoNotPileUpWhenALinkBreaksAgainAndAgain) {
  Budget memory(1 << 20);
  ArrivedTopics topics;
  const ArrivedTopics::key_type topic{"/a", "t"};
  topics[topic] = {7};
  for (int i = 0; i < 3; ++i)
    for (std::size_t n = 0; n < Arrived::kOriginsMax; ++n)
      note_end(topics, topic, numbered_gid(n), memory);
  ASSERT_TRUE(topics.contains(topic));
  EXPECT_EQ(topics.at(topic).origins.size(), Arrived::kOriginsMax);
  note_end(topics, topic, numbered_gid(Arrived::kOriginsMax), memory);
  EXPECT_FALSE(topics.contains(topic));
  note_end(topics, topic, numbered_gid(1), memory);  // nothing is kept of it: nothing to note
  EXPECT_TRUE(topics.empty());
  EXPECT_EQ(memory.used(), 0U);
}

TEST(Arrived, OriginsTakeMemoryOfTheLinkAndWithoutItTheTopicDoesNotGoOn) {
  Budget memory(2 * Arrived::kOriginBytes);
  ArrivedTopics topics;
  const ArrivedTopics::key_type topic{"/a", "t"};
  topics[topic] = {7};
  for (const std::size_t n : {1U, 1U, 2U}) note_end(topics, topic, numbered_gid(n), memory);
  EXPECT_EQ(memory.used(), 2 * Arrived::kOriginBytes);
  note_end(topics, topic, numbered_gid(3), memory);
  EXPECT_TRUE(topics.empty());
  EXPECT_EQ(memory.used(), 0U);
}

}  // namespace
}  // namespace connect_bridge
