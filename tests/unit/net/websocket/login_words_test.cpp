#include "net/websocket/login_words.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

using namespace std::chrono_literals;

TEST(LoginWords, EachHasAPace) {
  LoginWords words;
  const TimePoint begin{1h};
  words.add("", "203.0.113.5", begin);
  EXPECT_TRUE(words.empty());
  words.add("one", "203.0.113.5", begin);
  words.add("other", "203.0.113.5", begin);
  for (int i = 0; i < LoginWords::kAtOnce; ++i) EXPECT_TRUE(words.take("one", begin)) << i;
  EXPECT_FALSE(words.take("one", begin));
  EXPECT_TRUE(words.take("other", begin));
  EXPECT_FALSE(words.take("none", begin));
  EXPECT_TRUE(words.take("one", begin + LoginWords::kPeriod));
}

TEST(LoginWords, ManyLoginsOfAnAddressTakeTheWordsOfNoOther) {
  LoginWords words;
  TimePoint now{1h};
  words.add("calm", "198.51.100.1", now);
  for (std::size_t i = 0; i < 2 * LoginWords::kWordsMax; ++i)
    words.add(std::to_string(i), "203.0.113.5", now += 1ns);
  const std::size_t first_kept = 2 * LoginWords::kWordsMax - LoginWords::kOfAddressMax;
  EXPECT_FALSE(words.take(std::to_string(first_kept - 1), now));
  EXPECT_TRUE(words.take(std::to_string(first_kept), now));
  EXPECT_TRUE(words.take("calm", now));
  for (std::size_t i = 0; i < LoginWords::kWordsMax; ++i)
    words.add("of " + std::to_string(i), std::to_string(i), now += 1ns);
  EXPECT_FALSE(words.take("calm", now)) << "the oldest of all";
}

}  // namespace
}  // namespace connect_bridge
