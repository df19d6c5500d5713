#include "core/flow/drops.hpp"

#include <gtest/gtest.h>

#include <set>

namespace connect_bridge {
namespace {

TEST(Drops, EveryReasonHasANameOfItsOwn) {
  std::set<std::string_view> names;
  for (std::size_t i = 0; i < kDropReasons; ++i) names.insert(name_of(static_cast<DropReason>(i)));
  EXPECT_EQ(names.size(), kDropReasons);
  EXPECT_FALSE(names.contains("unknown"));
}

TEST(Drops, CountsAddUp) {
  DropCounts counts;
  counts.add(DropReason::kRate);
  counts.add(DropReason::kMaxAge, 4);
  EXPECT_EQ(counts.of(DropReason::kMaxAge), 4U);
  EXPECT_EQ(counts.total(), 5U);
}

}  // namespace
}  // namespace connect_bridge
