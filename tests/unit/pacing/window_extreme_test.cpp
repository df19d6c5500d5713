#include "core/pacing/window_extreme.hpp"

#include <gtest/gtest.h>

#include "unit/base/at.hpp"

namespace connect_bridge {
namespace {

using namespace std::chrono_literals;

using test::at;

TEST(WindowExtreme, IsTheLeastOfTheWindow) {
  WindowExtreme<int> least(-1);
  EXPECT_TRUE(least.empty());
  least.add(5, at(0), 100ms);
  least.add(7, at(10), 100ms);
  least.add(6, at(20), 100ms);
  EXPECT_EQ(least.get(), 5);
  least.add(9, at(101), 100ms);  // the first is too old
  EXPECT_EQ(least.get(), 6);
  least.add(1, at(102), 100ms);
  EXPECT_EQ(least.get(), 1);
}

TEST(WindowExtreme, IsTheMostOfTheWindow) {
  WindowExtreme<int> most(+1);
  most.add(5, at(0), 100ms);
  most.add(3, at(50), 100ms);
  EXPECT_EQ(most.get(), 5);
  most.add(1, at(120), 100ms);
  EXPECT_EQ(most.get(), 3);
}

TEST(WindowExtreme, ForgetsAllWhenToldTo) {
  WindowExtreme<int> least(-1);
  least.add(5, at(0), 100ms);
  least.clear();
  EXPECT_TRUE(least.empty());
  EXPECT_EQ(least.get(), 0);
}

}  // namespace
}  // namespace connect_bridge
