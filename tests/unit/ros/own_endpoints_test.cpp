#include "ros/node/own_endpoints.hpp"

#include <gtest/gtest.h>

namespace connect_bridge::ros {
namespace {

Gid id(std::uint32_t n) {
  Gid result;
  for (std::size_t i = 0; i < 4; ++i) result.bytes[i] = static_cast<std::uint8_t>(n >> (8 * i));
  return result;
}

// As many mirrors as there may be; an id that was forgotten would be taken for another process's.
TEST(OwnEndpoints, WhereIdsHaveNoPrefixThoseOfAllMirrorsAreKnown) {
  OwnEndpoints own(0);
  for (std::uint32_t n = 1; n <= 20'000; ++n) own.add(id(n));
  EXPECT_TRUE(own.contains(id(1)));
  EXPECT_TRUE(own.contains(id(20'000)));
  EXPECT_FALSE(own.contains(id(20'001)));
}

}  // namespace
}  // namespace connect_bridge::ros
