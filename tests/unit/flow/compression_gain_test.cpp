// Whether compression makes messages arrive sooner.
#include "core/flow/compression_gain.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

constexpr double kRate = 1e6;  // bytes per second

// Of so many messages of 100,000 bytes, which take this path 100 ms.
int compressed_of(CompressionGain& gain, int messages, double cost) {
  int count = 0;
  for (int i = 0; i < messages; ++i) count += int(gain.pays(100'000, kRate, cost));
  return count;
}

TEST(CompressionGain, WithoutAKnownRateNothingPays) {
  CompressionGain gain;
  for (int i = 0; i < 100; ++i) EXPECT_FALSE(gain.pays(100'000, 0, 0.001));  // nor is it tried
  EXPECT_FALSE(gain.likely_pays(100'000, 0, 0));
}

// Half of each message is hoped for at first: 50 ms.
TEST(CompressionGain, PaysWhereItSavesMoreTimeThanItCosts) {
  CompressionGain gain;
  EXPECT_TRUE(gain.pays(100'000, kRate, 0.049));
  EXPECT_FALSE(gain.likely_pays(100'000, kRate, 0.051));
  EXPECT_FALSE(gain.likely_pays(100'000, 10 * kRate, 0.049));
  EXPECT_FALSE(gain.likely_pays(10'000, kRate, 0.049));
}

TEST(CompressionGain, FollowsWhatTheLastMessagesSaved) {
  CompressionGain gain;
  for (int i = 0; i < 30; ++i) gain.note(0.9);
  EXPECT_NEAR(gain.ratio(), 0.9, 0.001);
  EXPECT_TRUE(gain.likely_pays(100'000, kRate, 0.009));
  EXPECT_FALSE(gain.likely_pays(100'000, kRate, 0.011));
  gain.note(0.1);
  EXPECT_NEAR(gain.ratio(), 0.7, 0.001);  // one message is no rule
}

// Its content may change, and nobody would know.
TEST(CompressionGain, AfterOneInVainItIsTriedFromTimeToTime) {
  CompressionGain gain;
  gain.note_in_vain();
  EXPECT_FALSE(gain.likely_pays(100'000, kRate, 0));
  EXPECT_EQ(compressed_of(gain, 63, 0.01), 0);
  EXPECT_EQ(compressed_of(gain, 1, 0.01), 1);
  EXPECT_EQ(compressed_of(gain, 640, 0.01), 10);
}

TEST(CompressionGain, WhatWouldNotPayIfItHalvedIsNotTried) {
  CompressionGain gain;
  gain.note_in_vain();
  EXPECT_EQ(compressed_of(gain, 1000, 0.051), 0);
}

TEST(CompressionGain, AfterATryThatShrinksItPaysAgain) {
  CompressionGain gain;
  gain.note_in_vain();
  gain.note(0.2);
  EXPECT_EQ(compressed_of(gain, 10, 0.01), 10);
}

}  // namespace
}  // namespace connect_bridge
