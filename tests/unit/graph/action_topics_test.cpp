#include "core/graph/action_topics.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

using Names = std::set<std::string>;

TEST(ActionTopics, NamesTheActionsThatHaveChanged) {
  ActionTopics topics;
  topics.set("/fib/_action/feedback", {1}, false);
  topics.set("/a/nav/_action/status", {2}, false);
  EXPECT_EQ(topics.take_changes(), (Names{"/a/nav", "/fib"}));
  topics.set("/fib/_action/feedback", {1}, false);
  EXPECT_EQ(topics.take_changes(), Names{});
  topics.set("/fib/_action/feedback", {1}, true);
  EXPECT_EQ(topics.take_changes(), Names{"/fib"});
  topics.remove("/fib/_action/feedback", {3});
  EXPECT_EQ(topics.take_changes(), Names{});
  topics.remove("/fib/_action/feedback", {1});
  EXPECT_EQ(topics.take_changes(), Names{"/fib"});
}

TEST(ActionTopics, AnActionIsFedWhenBothOfItsTopicsAre) {
  ActionTopics topics;
  topics.set("/fib/_action/feedback", {1}, true);
  EXPECT_FALSE(topics.are_mirrored("/fib"));
  topics.set("/fib/_action/status", {2}, false);
  EXPECT_TRUE(topics.are_mirrored("/fib"));
  EXPECT_FALSE(topics.are_fed("/fib"));
  topics.set("/fib/_action/status", {3}, true);
  EXPECT_TRUE(topics.are_fed("/fib"));
}

}  // namespace
}  // namespace connect_bridge
