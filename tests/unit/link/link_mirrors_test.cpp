// How many publishers here are of one link.
#include "core/link/link_mirrors.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <utility>

namespace connect_bridge {
namespace {

TEST(LinkMirrors, CountsInAllAndByNameAndType) {
  Budget places, memory;
  LinkMirrors count(places, memory);
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
TEST(LinkMirrors, TakesPlacesOfItsIdentityUntilItGoes) {
  Budget places(10);
  Budget memory;
  LinkMirrors stays(places, memory);
  std::optional<LinkMirrors> goes(std::in_place, places, memory);
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
