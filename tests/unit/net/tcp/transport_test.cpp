#include "net/tcp/transport.hpp"

#include <gtest/gtest.h>

#include <memory>

namespace connect_bridge::test {
namespace {

TEST(BlockMemory, ABlockIsUsedAgain) {
  BlockMemory memory;
  void* const block = memory.take(100);
  memory.give_back(block, 100);
  EXPECT_EQ(memory.take(500), block);
  memory.give_back(block, 500);
}

TEST(BlockMemory, BlocksThatAreInUseTogetherDiffer) {
  BlockMemory memory;
  void* const one = memory.take(100);
  void* const other = memory.take(100);
  EXPECT_NE(one, other);
  memory.give_back(other, 100);
  memory.give_back(one, 100);  // one is kept
  EXPECT_EQ(memory.take(1), other);
  memory.give_back(other, 1);
}

TEST(BlockMemory, ALargeBlockIsNotKept) {
  BlockMemory memory;
  memory.give_back(memory.take(1 << 20), 1 << 20);
  void* const block = memory.take(100);
  memory.give_back(block, 100);
  EXPECT_EQ(memory.take(100), block);
  memory.give_back(block, 100);
}

struct Owner {
  StepMemory memory;
};

TEST(IoHandler, TheNextStepMayBeginInTheHandlerOfTheLast) {
  const auto owner = std::make_shared<Owner>();
  int runs = 0;
  IoHandler next(owner->memory, [](ErrorCode, std::size_t) {});
  IoHandler first(owner->memory, [&, owner](ErrorCode, std::size_t bytes) {
    runs += static_cast<int>(bytes);
    next = IoHandler(owner->memory,
                     [&](ErrorCode, std::size_t more) { runs += static_cast<int>(more); });
  });
  first({}, 1);
  next({}, 10);
  EXPECT_EQ(runs, 11);
}

// As when the loop ends while operations are under way.
TEST(IoHandler, AHandlerThatNeverRunsMayBeTheLastToKeepTheMemory) {
  auto owner = std::make_shared<Owner>();
  const std::weak_ptr<Owner> there = owner;
  {
    const IoHandler handler(owner->memory, [owner](ErrorCode, std::size_t) {});
    owner.reset();
    EXPECT_FALSE(there.expired());
  }
  EXPECT_TRUE(there.expired());
}

}  // namespace
}  // namespace connect_bridge::test
