// What may still lie in a server's queue: by what its answers prove, and by their absence.
#include "core/services/server_queue.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

using std::chrono::seconds;

TimePoint at_second(int s) {
  return TimePoint{seconds(s)};
}

// Requests 1 to `count`, one each second from 1 s on.
ServerQueue given(std::uint32_t count) {
  ServerQueue queue{seconds(100)};
  for (std::uint32_t i = 1; i <= count; ++i) queue.hand_over({i}, at_second(static_cast<int>(i)));
  return queue;
}

TEST(ServerQueue, AnAnswerProvesThatWhatWasHandedOverBeforeIsTaken) {
  ServerQueue queue = given(5);
  EXPECT_EQ(queue.size(), 5U);
  queue.answered({3}, at_second(6));
  EXPECT_EQ(queue.size(), 2U);
  queue.answered({2}, at_second(6));
  EXPECT_EQ(queue.size(), 2U);
  queue.answered({5}, at_second(6));
  EXPECT_EQ(queue.size(), 0U);
  EXPECT_FALSE(queue.deadline());
}

TEST(ServerQueue, HasRoomUpToItsDepth) {
  ServerQueue queue = given(5);
  EXPECT_TRUE(queue.has_room(6, 0, {}));
  EXPECT_FALSE(queue.has_room(6, 1, {}));
  EXPECT_FALSE(queue.has_room(5, 0, {}));
  EXPECT_TRUE(queue.has_room(0, 100, {}));
}

TEST(ServerQueue, WhatIsHandedOverWithoutADepthIsBounded) {
  ServerQueue queue = given(ServerQueue::kEntriesMax + 1);
  EXPECT_EQ(queue.size(), ServerQueue::kEntriesMax);
}

TEST(ServerQueue, WhatCouldNotBeSentIsNotThere) {
  ServerQueue queue = given(3);
  queue.failed({2});
  EXPECT_EQ(queue.size(), 2U);
  queue.failed({9});
  EXPECT_EQ(queue.size(), 2U);
  queue.answered({2}, at_second(4));  // and proves nothing
  EXPECT_EQ(queue.size(), 2U);
}

TEST(ServerQueue, WhatIsNotAnsweredIsPresumedTakenInTime) {
  ServerQueue queue = given(3);
  EXPECT_EQ(queue.deadline(), at_second(101));
  queue.expire(at_second(100));
  EXPECT_EQ(queue.size(), 3U);
  queue.expire(at_second(102));
  EXPECT_EQ(queue.size(), 1U);
  EXPECT_EQ(queue.deadline(), at_second(103));
}

TEST(ServerQueue, TheTimeCountsFromTheLastAnswerThatProvedSomething) {
  ServerQueue queue = given(3);
  queue.answered({2}, at_second(50));
  EXPECT_EQ(queue.deadline(), at_second(150));
  queue.answered({1}, at_second(60));
  EXPECT_EQ(queue.deadline(), at_second(150));
  queue.hand_over({4}, at_second(140));
  queue.expire(at_second(150));
  EXPECT_EQ(queue.size(), 1U);
  EXPECT_EQ(queue.deadline(), at_second(240));
}

TEST(ServerQueue, AnotherServersQueueIsEmpty) {
  ServerQueue queue = given(3);
  queue.answered({1}, at_second(50));
  queue.clear();
  EXPECT_EQ(queue.size(), 0U);
  queue.hand_over({1}, at_second(3));
  EXPECT_EQ(queue.deadline(), at_second(103));
}

}  // namespace
}  // namespace connect_bridge
