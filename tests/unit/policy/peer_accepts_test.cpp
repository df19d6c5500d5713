#include "core/policy/peer_accepts.hpp"

#include <gtest/gtest.h>

#include <string>

namespace connect_bridge {
namespace {

Interface topic_of(const std::string& name) {
  return {InterfaceKind::kTopic, name, "p/msg/T"};
}

Accepts denying(int patterns, const std::string& text) {
  Accepts accepts{{{{"/**"}, {}}}, {}};
  accepts.deny.assign(static_cast<std::size_t>(patterns), text);
  return accepts;
}

const std::string kLong = "/" + std::string(254, 'a');

TEST(PeerAccepts, AShortListIsComparedAtOnce) {
  const PeerAccepts accepts(denying(15, "/camera/**"));
  EXPECT_EQ(accepts.takes(topic_of("/camera/image")), false);
  EXPECT_EQ(accepts.takes(topic_of("/map")), true);
  EXPECT_FALSE(accepts.lacks());
}

// Each star may make it read the whole name.
TEST(PeerAccepts, ALongNameCountsByEachPatternWithAStar) {
  PeerAccepts accepts(denying(15, "/*b/c"));
  EXPECT_EQ(accepts.takes(topic_of("/short")), true);
  const std::string longer = "/" + std::string(200, 'a');
  EXPECT_EQ(accepts.takes(topic_of(kLong)), std::nullopt);
  EXPECT_EQ(accepts.takes(topic_of(longer)), std::nullopt);
  const auto cost = accepts.compare();
  EXPECT_GT(cost, 16 * 2 * kLong.size());
  EXPECT_EQ(cost - accepts.compare(), 16 * 2 * (kLong.size() - longer.size()));
  EXPECT_FALSE(accepts.lacks());
  EXPECT_EQ(accepts.takes(topic_of(kLong)), true);
}

TEST(PeerAccepts, ALongNameCountsNotWherePatternsHaveNoStar) {
  const PeerAccepts accepts(denying(100, "/b/c"));
  EXPECT_EQ(accepts.takes(topic_of(kLong)), true);
}

}  // namespace
}  // namespace connect_bridge
