// Topics of one name with several types, of which the middleware lets a process use one.
#include "core/topics/subscribed_names.hpp"

#include <gtest/gtest.h>

#include "unit/topics/exporting.hpp"

namespace connect_bridge::topics_test {
namespace {

struct Named {
  Exporting s;
  LocalTopic one{s.context, {"/a", kType}};
  LocalTopic two{s.context, {"/a", "p/msg/U"}};
  SubscribedNames names;
};

TEST(SubscribedNames, ANameIsFreeForWhoHasItAlone) {
  Named s;
  EXPECT_TRUE(s.names.are_free("/a", s.one));
  EXPECT_EQ(s.names.take("/a", s.one, false), nullptr);
  EXPECT_TRUE(s.names.are_free("/a", s.one));
  EXPECT_FALSE(s.names.are_free("/a", s.two));
  EXPECT_TRUE(s.names.are_free("/b", s.two));
  s.names.leave("/a", s.one);
  EXPECT_TRUE(s.names.are_free("/a", s.two));
}

// Local publishers of two types: what the middleware makes of it is the operator's.
TEST(SubscribedNames, TopicsWithPublishersDoNotDriveEachOtherAway) {
  Named s;
  EXPECT_EQ(s.names.take("/a", s.one, false), nullptr);
  EXPECT_EQ(s.names.take("/a", s.two, false), nullptr);
  EXPECT_FALSE(s.names.are_free("/a", s.one));
  s.names.leave("/a", s.two);
  EXPECT_TRUE(s.names.are_free("/a", s.one));
  EXPECT_TRUE(s.names.standing().empty());
}

TEST(SubscribedNames, ATopicForListenersAloneGivesWayToOneWithPublishers) {
  Named s;
  EXPECT_EQ(s.names.take("/a", s.one, true), nullptr);
  EXPECT_EQ(s.names.standing(), std::vector<LocalTopic*>{&s.one});
  EXPECT_EQ(s.names.take("/b", s.two, false), nullptr);
  EXPECT_EQ(s.names.take("/a", s.two, false), &s.one);
  s.names.leave("/a", s.one);  // so it ends its subscription
  EXPECT_TRUE(s.names.standing().empty());
  EXPECT_TRUE(s.names.are_free("/a", s.two));
}

TEST(SubscribedNames, ATopicThatGetsAPublisherGivesWayNoLonger) {
  Named s;
  EXPECT_EQ(s.names.take("/a", s.one, true), nullptr);
  EXPECT_EQ(s.names.take("/a", s.one, false), nullptr);
  EXPECT_TRUE(s.names.standing().empty());
  EXPECT_EQ(s.names.take("/a", s.two, false), nullptr);
}

TEST(SubscribedNames, WhoLeavesTakesNothingOfOthersWithIt) {
  Named s;
  EXPECT_EQ(s.names.take("/a", s.one, true), nullptr);
  s.names.leave("/a", s.two);
  s.names.leave("/b", s.one);
  EXPECT_EQ(s.names.standing(), std::vector<LocalTopic*>{&s.one});
  EXPECT_FALSE(s.names.are_free("/a", s.two));
}

}  // namespace
}  // namespace connect_bridge::topics_test
