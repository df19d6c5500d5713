#include "core/base/address_paces.hpp"

#include <gtest/gtest.h>

#include "unit/base/at.hpp"

namespace connect_bridge {
namespace {

using std::chrono::milliseconds;
using test::at;

TEST(Pace, ReservesTurnsOneAfterTheOther) {
  Pace pace(2, milliseconds(100));
  EXPECT_EQ(pace.reserve(at(1000)), at(1000));
  EXPECT_EQ(pace.reserve(at(1000)), at(1000));
  EXPECT_EQ(pace.reserve(at(1000)), at(1100));
  EXPECT_EQ(pace.reserve(at(1050)), at(1200));
  EXPECT_FALSE(pace.take(at(1299)));
  EXPECT_TRUE(pace.take(at(1300)));
}

TEST(AddressPaces, EachAddressHasItsOwn) {
  AddressPaces paces(2, milliseconds(100));
  EXPECT_TRUE(paces.take("10.0.0.1", 1, at(0)));
  EXPECT_TRUE(paces.take("10.0.0.1", 1, at(0)));
  EXPECT_FALSE(paces.take("10.0.0.1", 1, at(0)));
  EXPECT_TRUE(paces.take("10.0.0.2", 1, at(0)));
  EXPECT_TRUE(paces.take("10.0.0.1", 1, at(100)));
  EXPECT_FALSE(paces.take("10.0.0.1", 1, at(100)));
}

TEST(AddressPaces, WhatDidNotHappenIsGivenBack) {
  AddressPaces paces(2, milliseconds(100));
  EXPECT_TRUE(paces.take("10.0.0.1", 1, at(0)));
  EXPECT_TRUE(paces.take("10.0.0.1", 1, at(0)));
  paces.give_back("10.0.0.1");
  paces.give_back("10.0.0.2");  // of which nothing is known
  EXPECT_TRUE(paces.take("10.0.0.1", 1, at(0)));
  EXPECT_FALSE(paces.take("10.0.0.1", 1, at(0)));
}

TEST(AddressPaces, AShareIsSoManyTimesAsMuch) {
  AddressPaces paces(2, milliseconds(80));
  for (int i = 0; i < 16; ++i) EXPECT_TRUE(paces.take("127.0.0.1", 8, at(0))) << i;
  EXPECT_FALSE(paces.take("127.0.0.1", 8, at(9)));
  EXPECT_TRUE(paces.take("127.0.0.1", 8, at(10)));
}

// Addresses are free: they must not fill the memory. A known one stays limited.
TEST(AddressPaces, KnowsNoMoreThanSoMany) {
  AddressPaces paces(1, milliseconds(5000));
  for (std::size_t i = 0; i < AddressPaces::kAddressesMax; ++i)
    EXPECT_TRUE(paces.take(std::to_string(i), 1, at(10)));
  EXPECT_FALSE(paces.take("7", 1, at(10)));
  EXPECT_TRUE(paces.take("new", 1, at(10)));
  EXPECT_TRUE(paces.take("new", 1, at(10)));
  EXPECT_TRUE(paces.take("new", 1, at(6000)));  // the others are forgotten
  EXPECT_FALSE(paces.take("new", 1, at(6000)));
}

}  // namespace
}  // namespace connect_bridge
