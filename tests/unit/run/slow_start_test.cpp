#include "run/slow_start.hpp"

#include <gtest/gtest.h>

#include <future>

namespace connect_bridge {
namespace {

using namespace std::chrono_literals;

TEST(SlowStart, IsToldOnce) {
  std::promise<void> told;  // a second set_value() would throw
  const auto slow = says_if_slow(1ms, [&] { told.set_value(); });
  EXPECT_EQ(told.get_future().wait_for(10s), std::future_status::ready);
}

TEST(SlowStart, AGoodStartIsSilent) {
  {
    const auto good = says_if_slow(1h, [] { ADD_FAILURE(); });
  }
}

}  // namespace
}  // namespace connect_bridge
