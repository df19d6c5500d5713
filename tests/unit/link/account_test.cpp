#include "core/link/account.hpp"

#include <gtest/gtest.h>

#include "unit/base/at.hpp"

namespace connect_bridge {
namespace {

using std::chrono::milliseconds;
using test::at;

int appear(Account& account, int ms) {
  int made = 0;
  while (account.wait_to_appear(account.mirrors, at(ms)) == Duration::zero()) ++made;
  return made;
}

// How many messages of this size, whose bodies have two kilobytes, are decompressed in 16 s.
int bombs(std::uint64_t raw_bytes) {
  Account account;
  int inflated = 0;
  for (int ms = 0; ms < 16'000; ++ms) inflated += int(account.may_inflate(raw_bytes, 2000, at(ms)));
  return inflated;
}

// The middleware takes some 0.3 ms for each, and whatever else arrives waits for the step to end.
TEST(Account, OnlyAFewAppearInOneStepWhoeverAsks) {
  Accounts accounts{AccountOptions{}};
  const auto one = accounts.of("one");
  const auto other = accounts.of("other");
  EXPECT_EQ(appear(*one, 1000), 8);
  EXPECT_EQ(appear(*other, 1000), 0);
  EXPECT_EQ(other->wait_to_appear(other->mirrors, at(1000)), Shares::kNextStep);
  EXPECT_EQ(appear(*other, 1001), 4);
  EXPECT_EQ(appear(*one, 1003), 8);
}

TEST(Account, WhoHasUsedUpItsPaceDoesNotHoldUpOthers) {
  AccountOptions options;
  options.mirrors_at_once = 2;
  Accounts accounts(options);
  const auto one = accounts.of("one");
  const auto other = accounts.of("other");
  EXPECT_EQ(appear(*one, 1000), 2);
  EXPECT_EQ(one->wait_to_appear(one->mirrors, at(1000)), Account::kPacing);
  EXPECT_EQ(appear(*other, 1000), 2);
  EXPECT_EQ(appear(*one, 1005), 1);
}

// The loop stands while a sample is published, in proportion to its size: what it grows beyond the
// usual costs more where that is long. Small ones have 64 MiB a second,
// and ten seconds' worth at once.
TEST(Account, TheLargerABombTheFewerBytesItMayBecome) {
  EXPECT_EQ(bombs(64 << 20), 4);
  EXPECT_EQ(bombs(16 << 20), 14);
  EXPECT_EQ(bombs(8 << 20), 53);
  EXPECT_NEAR(bombs(2 << 20), 26 * 32, 30);
  EXPECT_EQ(bombs(64'000), 16'000);  // no more than usual
}

}  // namespace
}  // namespace connect_bridge
