#include "core/link/account.hpp"

#include <gtest/gtest.h>

#include <string>

#include "unit/base/at.hpp"

namespace connect_bridge {
namespace {

using test::at;

// How many messages of this size, whose bodies have two kilobytes, are decompressed in 16 s.
int bombs(std::uint64_t raw_bytes) {
  Account account;
  int inflated = 0;
  for (int ms = 0; ms < 16'000; ++ms) inflated += int(account.may_inflate(raw_bytes, 2000, at(ms)));
  return inflated;
}

// The loop stands while a sample is published, in proportion to its size: what it grows beyond the
// usual costs more where that is long. Small ones have 64 MiB a second, and ten seconds' worth at
// once; of the largest 4 MiB a second.
TEST(Account, TheLargerABombTheFewerBytesItMayBecome) {
  EXPECT_EQ(bombs(64 << 20), 2);
  EXPECT_EQ(bombs(16 << 20), 14);
  EXPECT_EQ(bombs(8 << 20), 53);
  EXPECT_NEAR(bombs(2 << 20), 26 * 32, 30);
  EXPECT_EQ(bombs(64'000), 16'000);  // no more than usual
}

// A peer that sends a large map goes on with small ones.
TEST(Account, AfterOneOfTheLargestSmallOnesPass) {
  Account account;
  EXPECT_TRUE(account.may_inflate(64 << 20, 2000, at(0)));
  EXPECT_FALSE(account.may_inflate(20 << 20, 2000, at(1)));
  EXPECT_TRUE(account.may_inflate(2 << 20, 2000, at(1)));
}

constexpr std::uint64_t kBomb = 64 << 20;
constexpr std::uint64_t kMiddling = 16 << 20;  // none of the largest, but as dear as any

// How many bombs so many identities have decompressed within 16 s, one from each in a millisecond.
int bombs_of(int identities) {
  Accounts accounts{AccountOptions{}};
  int inflated = 0;
  for (int ms = 0; ms < 16'000; ++ms)
    for (int i = 0; i < identities; ++i)
      inflated += int(accounts.of(std::to_string(i))->may_inflate(kBomb, 2000, at(ms)));
  return inflated;
}

TEST(Account, ManyIdentitiesHaveNotMoreThanFourInBombs) {
  EXPECT_EQ(bombs_of(1), 2);
  EXPECT_EQ(bombs_of(2), 4);
  EXPECT_NEAR(bombs_of(4), 7, 1);
  EXPECT_EQ(bombs_of(100), bombs_of(4));
}

// What compresses well and comes now and then passes, whatever others do.
TEST(Account, BesideBombsOfOthersEachHasItsPart) {
  Accounts accounts{AccountOptions{}};
  for (int i = 0; i < 100; ++i)
    static_cast<void>(accounts.of(std::to_string(i))->may_inflate(kMiddling, 2000, at(0)));
  const auto other = accounts.of("robot");
  EXPECT_FALSE(other->may_inflate(kBomb, 2000, at(1)));
  for (int s = 0; s < 10; ++s)
    for (int i = 0; i < 30; ++i) EXPECT_TRUE(other->may_inflate(2 << 20, 2000, at(1000 * s + 1)));
  EXPECT_FALSE(accounts.of("0")->may_inflate(2 << 20, 2000, at(1)));
}

// An identity that comes again after others is the same as before.
TEST(Account, WhoOwesIsNotForgotten) {
  Accounts accounts{AccountOptions{}};
  while (accounts.of("one")->may_inflate(kMiddling, 2000, at(0))) {
  }
  for (int i = 0; i < 1000; ++i) static_cast<void>(accounts.of(std::to_string(i)));
  EXPECT_FALSE(accounts.of("one")->may_inflate(2 << 20, 2000, at(0)));
}

}  // namespace
}  // namespace connect_bridge
