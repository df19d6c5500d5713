// Slots that are marked for an entity that is gone.
#include "ros/entities/ready_list.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "ros/entities/entity.hpp"

namespace connect_bridge::ros {
namespace {

// Does one kind of things, and counts its turns.
class Fake : public Entity {
 public:
  Fake(ReadyList& ready, std::uint32_t own) : Entity(ready, own), own_(own) {}

  std::optional<Input> step(Batch&) override {
    ++turns;
    done(own_);
    return std::nullopt;
  }
  [[nodiscard]] const void* user_data() const { return slot(); }

  int turns = 0;

 private:
  const std::uint32_t own_;
};

int steps_until_idle(ReadyList& ready) {
  Batch batch;
  while (!ready.idle() && batch.steps < 100) ready.step(batch);
  return batch.steps;
}

TEST(ReadyList, AMarkOfAnEntityThatIsGoneDoesNotHoldTheNextOne) {
  ReadyList ready([] {});
  auto gone = std::make_unique<Fake>(ready, kReadyMessage);
  const void* slot = gone->user_data();
  ReadyList::on_message(slot, 1);
  gone.reset();
  Fake next(ready, kReadyFailed);
  ASSERT_EQ(next.user_data(), slot);
  ready.collect();
  EXPECT_EQ(steps_until_idle(ready), 0);
  EXPECT_EQ(next.turns, 0);
  ReadyList::mark(const_cast<ReadyList::Slot*>(static_cast<const ReadyList::Slot*>(slot)),
                  kReadyFailed);
  ready.collect();
  EXPECT_EQ(steps_until_idle(ready), 1);
  EXPECT_EQ(next.turns, 1);
}

TEST(ReadyList, AnEntityThatEndsBeforeItsTurnLeavesNoneToTheNextOne) {
  ReadyList ready([] {});
  auto gone = std::make_unique<Fake>(ready, kReadyMessage);
  ReadyList::on_message(gone->user_data(), 1);
  ready.collect();
  gone.reset();
  Fake next(ready, kReadyMessage);
  EXPECT_LE(steps_until_idle(ready), 1);
  EXPECT_EQ(next.turns, 0);
}

TEST(ReadyList, EachStepCounts) {
  ReadyList ready([] {});
  // It never says that it is done.
  struct Endless : Entity {
    explicit Endless(ReadyList& list) : Entity(list, kReadyMessage) {}
    std::optional<Input> step(Batch&) override { return std::nullopt; }
    void begin() { ReadyList::mark(slot(), kReadyMessage); }
  } endless(ready);
  endless.begin();
  ready.collect();
  EXPECT_EQ(steps_until_idle(ready), 100);
}

}  // namespace
}  // namespace connect_bridge::ros
