#include "core/link/proxy_names.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace connect_bridge::test {
namespace {

TEST(ProxyNames, AreLimitedAndComeFreeWithTheirLastHold) {
  std::vector<ProxyNames::Hold> holds;
  ProxyNames names;
  for (std::size_t n = 0; n < ProxyNames::kMost; ++n)
    holds.push_back(names.take("/node" + std::to_string(n)));
  EXPECT_EQ(*holds.front(), "/node0");
  EXPECT_FALSE(names.take("/other"));
  auto again = names.take("/node0");  // in use already
  ASSERT_TRUE(again);
  holds.front().reset();
  EXPECT_FALSE(names.take("/other"));
  again.reset();
  EXPECT_TRUE(names.take("/other"));
}

TEST(ProxyNames, AHoldMayOutliveTheIdentity) {
  ProxyNames::Hold hold;
  {
    ProxyNames names;
    hold = names.take("/node");
  }
  EXPECT_EQ(*hold, "/node");
}

}  // namespace
}  // namespace connect_bridge::test
