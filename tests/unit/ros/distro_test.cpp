// What differs between distributions, for the sizes that another one than ours has.
#include "ros/rcl/distro.hpp"

#include <gtest/gtest.h>

#include <numeric>
#include <set>

namespace connect_bridge::ros {
namespace {

template <std::size_t kSize>
Gid id_with_last_byte(std::uint8_t last) {
  std::uint8_t bytes[kSize];
  std::iota(std::begin(bytes), std::end(bytes), std::uint8_t{1});
  bytes[kSize - 1] = last;
  return distro::gid_of(bytes);
}

// Since Iron.
TEST(Distro, AnIdOf16BytesIsFollowedByZeros) {
  const Gid gid = id_with_last_byte<16>(16);
  for (std::size_t i = 0; i < 16; ++i) EXPECT_EQ(gid.bytes[i], i + 1);
  for (std::size_t i = 16; i < gid.bytes.size(); ++i) EXPECT_EQ(gid.bytes[i], 0);
}

// Humble.
TEST(Distro, AnIdOf24BytesIsWhole) {
  const Gid gid = id_with_last_byte<24>(24);
  for (std::size_t i = 0; i < 24; ++i) EXPECT_EQ(gid.bytes[i], i + 1);
}

TEST(Distro, TheLastByteTellsPublishersApart) {
  const std::set<Gid> told = {id_with_last_byte<16>(1), id_with_last_byte<16>(2),
                              id_with_last_byte<24>(1), id_with_last_byte<24>(2)};
  EXPECT_EQ(4u, told.size());
}

}  // namespace
}  // namespace connect_bridge::ros
