#include "run/loop_guard.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <future>

#include "run/signals.hpp"

namespace connect_bridge {
namespace {

using namespace std::chrono_literals;

void expect_no_call() {
  ADD_FAILURE();
}

TEST(Standstill, IsThereAfterSoManyTicksWithoutAMove) {
  Standstill standstill(3);
  EXPECT_FALSE(standstill.tick(7));  // has moved
  EXPECT_FALSE(standstill.tick(7));
  EXPECT_FALSE(standstill.tick(7));
  EXPECT_TRUE(standstill.tick(7));
}

TEST(Standstill, EachMoveBeginsTheCountAgain) {
  Standstill standstill(2);
  for (std::uint64_t moves = 1; moves < 10; ++moves) {
    EXPECT_FALSE(standstill.tick(moves));
    EXPECT_FALSE(standstill.tick(moves));
  }
  EXPECT_TRUE(standstill.tick(9));
}

TEST(Standstill, OfALoopThatHasNeverMoved) {
  Standstill standstill(2);
  EXPECT_FALSE(standstill.tick(0));
  EXPECT_TRUE(standstill.tick(0));
}

TEST(LoopGuard, EndsALoopThatStandsStill) {
  std::promise<void> ended;  // a second set_value() would throw
  LoopGuard guard({1ms, 3}, {expect_no_call, [&] { ended.set_value(); }});
  guard.moved();
  guard.watch();
  EXPECT_EQ(ended.get_future().wait_for(10s), std::future_status::ready);
}

TEST(LoopGuard, LetsALoopBeThatIsNotWatchedYet) {
  const LoopGuard guard({1ms, 3}, {expect_no_call, expect_no_call});
  std::promise<void> never;
  EXPECT_EQ(never.get_future().wait_for(50ms), std::future_status::timeout);
}

// While this thread, which stands for the loop, does nothing but wait.
TEST(LoopGuard, KnowsTheFirstSignalAndWatchesNoLonger) {
  std::promise<void> stopped;
  LoopGuard guard({20ms, 1}, {[&] { stopped.set_value(); }, expect_no_call});
  std::raise(SIGTERM);
  std::raise(SIGINT);
  EXPECT_EQ(stopped.get_future().wait_for(10s), std::future_status::ready);
  guard.watch();
  std::promise<void> never;
  EXPECT_EQ(never.get_future().wait_for(100ms), std::future_status::timeout);
}

TEST(EndWithinDeathTest, TheFirstCallCounts) {
  const auto waits_for_ever = [] {
    end_within(20ms);
    end_within(1h);
    for (;;) ::pause();
  };
  EXPECT_EXIT(waits_for_ever(), testing::KilledBySignal(SIGALRM), "");
}

}  // namespace
}  // namespace connect_bridge
