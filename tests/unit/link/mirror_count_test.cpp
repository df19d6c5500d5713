// How many publishers here are of one link.
#include "core/link/mirror_count.hpp"

#include <gtest/gtest.h>

#include <optional>

namespace connect_bridge {
namespace {

TEST(MirrorCount, CountsInAllAndByNameAndType) {
  Budget places;
  MirrorCount count(places);
  count.add({"/a", "p/msg/T"});
  count.add({"/a", "p/msg/T"});
  count.add({"/a", "p/msg/U"});
  count.add({"/b", "p/msg/T"});
  EXPECT_EQ(count.all(), 4U);
  EXPECT_EQ(count.of({"/a", "p/msg/T"}), 2U);
  EXPECT_EQ(count.of({"/a", "p/msg/U"}), 1U);
  EXPECT_EQ(count.of({"/b", "p/msg/U"}), 0U);
  count.remove({"/a", "p/msg/T"});
  EXPECT_EQ(count.of({"/a", "p/msg/T"}), 1U);
  count.remove({"/a", "p/msg/T"});
  EXPECT_EQ(count.of({"/a", "p/msg/T"}), 0U);
  EXPECT_EQ(count.all(), 2U);
}

// Links of an identity share its places; one that goes leaves them to the others.
TEST(MirrorCount, TakesPlacesOfItsIdentityUntilItGoes) {
  Budget places(10);
  MirrorCount stays(places);
  std::optional<MirrorCount> goes(places);
  stays.add({"/a", "p/msg/T"});
  for (int i = 0; i < 3; ++i) goes->add({"/a", "p/msg/T"});
  EXPECT_EQ(places.used(), 4U);
  EXPECT_EQ(stays.all(), 1U);
  goes->remove({"/a", "p/msg/T"});
  EXPECT_EQ(places.used(), 3U);
  goes.reset();
  EXPECT_EQ(places.used(), 1U);
}

}  // namespace
}  // namespace connect_bridge
