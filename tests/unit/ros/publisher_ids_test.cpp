// A middleware that gives handles where others give ids.
#include "ros/rcl/publisher_ids.hpp"

#include <gtest/gtest.h>

#include <utility>

namespace connect_bridge::ros {
namespace {

Gid numbered(std::uint32_t number, std::uint8_t kind) {
  Gid gid;
  for (std::size_t i = 0; i < 4; ++i) gid.bytes[i] = static_cast<std::uint8_t>(number >> (8 * i));
  gid.bytes[15] = kind;
  return gid;
}
Gid handle(std::uint32_t number) {
  return numbered(number, 1);
}
Gid id(std::uint32_t number) {
  return numbered(number, 2);
}

class PublisherIdsTest : public testing::Test {
 protected:
  void comes(std::uint32_t number) { changes_.push_back({handle(number), id(number), false}); }
  void leaves(std::uint32_t number) { changes_.push_back({handle(number), id(number), true}); }

  std::vector<PublisherChange> changes_;  // that nobody has asked for
  int asked_ = 0;
  PublisherIds ids_{[this] {
    ++asked_;
    return std::exchange(changes_, {});
  }};
};

TEST(PublisherIds, WithoutSourceWhatIsToldIsTheId) {
  PublisherIds ids;
  EXPECT_EQ(ids.id_of(handle(7)), handle(7));
}

TEST_F(PublisherIdsTest, TellsPublishersApart) {
  comes(1);
  comes(2);
  EXPECT_EQ(ids_.id_of(handle(2)), id(2));
  EXPECT_EQ(ids_.id_of(handle(1)), id(1));
  EXPECT_EQ(asked_, 1);  // known ones are not asked for
}

TEST_F(PublisherIdsTest, FindsWhoComesLater) {
  comes(1);
  ids_.refresh();
  comes(2);
  EXPECT_EQ(ids_.id_of(handle(2)), id(2));
}

// Its last samples are taken after it has left; they must not count as another's.
TEST_F(PublisherIdsTest, WhoHasLeftIsKnownForAWhile) {
  comes(1);
  leaves(1);
  EXPECT_EQ(ids_.id_of(handle(1)), id(1));
  for (std::uint32_t i = 2; i < 5000; ++i) {
    comes(i);
    leaves(i);
  }
  EXPECT_EQ(ids_.id_of(handle(4999)), id(4999));
  EXPECT_EQ(ids_.id_of(handle(1)), handle(1));
}

// No publisher of the graph has that id, so its samples cannot be attributed to another.
TEST_F(PublisherIdsTest, NobodyIsTakenForAnother) {
  comes(1);
  EXPECT_EQ(ids_.id_of(handle(2)), handle(2));
}

TEST_F(PublisherIdsTest, ASourceThatSaysNothingTellsNoId) {
  EXPECT_EQ(ids_.id_of(handle(1)), Gid{});
}

}  // namespace
}  // namespace connect_bridge::ros
