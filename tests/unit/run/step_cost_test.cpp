#include "run/step_cost.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <mutex>
#include <thread>
#include <vector>

namespace connect_bridge::test {
namespace {

using namespace std::chrono_literals;

void compute_for(Duration processor_time) {
  const std::clock_t end =
      std::clock() + static_cast<std::clock_t>(processor_time / 1us * CLOCKS_PER_SEC / 1'000'000);
  while (std::clock() < end) {
  }
}

// What the machine takes, here a sleep, is nobody's; what this thread computes is.
TEST(StepCost, OfOurOwnCodeOnlyProcessorTimeCounts) {
  StepCost cost;
  cost.begin(false);
  std::this_thread::sleep_for(300ms);
  EXPECT_LT(cost.own(), 100ms);
  cost.begin(false);
  compute_for(20ms);
  EXPECT_GE(cost.own(), 15ms);
}

// A long part pays for what it computed, and not for the part before it.
TEST(StepCost, APartDoesNotPayForAnother) {
  StepCost cost;
  cost.begin(false);
  compute_for(40ms);
  EXPECT_GE(cost.own(), 30ms);
  std::this_thread::sleep_for(60ms);
  EXPECT_LT(cost.own(), 20ms);
  compute_for(40ms);
  cost.begin(false);
  std::this_thread::sleep_for(60ms);
  EXPECT_LT(cost.own(), 20ms);
}

TEST(StepCost, InsideTheMiddlewareALockThatAnotherThreadHoldsCounts) {
  StepCost cost;
  std::mutex held;
  held.lock();
  cost.begin(false);
  cost.enter();
  std::thread other([&] {
    std::this_thread::sleep_for(50ms);
    held.unlock();
  });
  held.lock();
  EXPECT_GE(cost.inside(), 40ms);
  held.unlock();
  other.join();
}

Duration processor_time() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return Duration(t.tv_sec * 1'000'000'000LL + t.tv_nsec);
}

// More threads than processors: each waits for the others, and pays for nothing of that.
TEST(StepCost, InsideTheMiddlewareWhatOthersComputeDoesNotCount) {
  std::vector<std::thread> threads;
  for (unsigned n = 0; n < 2 * std::thread::hardware_concurrency(); ++n)
    threads.emplace_back([] {
      StepCost cost;
      cost.begin(false);
      cost.enter();
      const Duration before = processor_time();
      while (processor_time() < before + 50ms) {
      }
      EXPECT_LT(cost.inside(), 60ms);
    });
  for (std::thread& thread : threads) thread.join();
}

TEST(StepCost, WhoeverIsAlonePaysWallTimeUntilAnotherComes) {
  StepCost cost;
  cost.begin(true);
  std::this_thread::sleep_for(60ms);
  EXPECT_GE(cost.own(), 60ms);
  cost.begin(false);
  std::this_thread::sleep_for(300ms);
  EXPECT_LT(cost.own(), 100ms);
}

TEST(StepCost, TheTimeThatOthersTakeIsKnownOfEachStep) {
  StepCost cost;
  cost.begin(false);
  std::this_thread::sleep_for(60ms);
  cost.skip();
  EXPECT_GE(cost.taken(), 50ms);
  cost.begin(false);
  EXPECT_EQ(cost.taken(), 0ms);
}

}  // namespace
}  // namespace connect_bridge::test
