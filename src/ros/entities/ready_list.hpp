// The entities that have something to do: marked by middleware callbacks on any thread, given their
// turns by the loop.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <vector>

#include "core/ports/ports.hpp"

namespace connect_bridge::ros {

class Entity;

// What there is to do, as bits.
enum ReadyBit : std::uint32_t {
  kReadyMessage = 1,       // samples, requests, responses or a graph can be taken
  kReadyLost = 2,          // event: message lost
  kReadyIncompatible = 4,  // event: incompatible QoS
  kReadyFailed = 8,        // samples could not be published
  kReadyChanged = 16,      // the graph has changed
  kReadyLook = 32,         // it is time to look at the graph again
};

// What the entities have done since the loop began to drain them.
struct Batch {
  int steps = 0;  // each counts, also one that finds nothing: nobody can hold the loop
  std::size_t bytes = 0;
};

// Callbacks hold the address of a Slot. Slots are recycled and never freed before the list. A slot
// may be marked for an entity that is gone when it is given to the next one: of such marks only
// those of the new entity's own kind count, and at worst it finds nothing to do.
class ReadyList {
 public:
  struct Slot {
    ReadyList* list = nullptr;
    std::atomic<std::uint32_t> bits{0};   // marked and not collected yet
    std::atomic<std::size_t> counted{0};  // arrivals that were reported by on_counted()
    // Of the loop's thread:
    Entity* entity = nullptr;  // nullptr: free
    std::uint32_t own = 0;     // bits that the entity knows
    bool in_turn = false;      // is in turns_
    std::uint32_t to_do = 0;   // bits that were collected and are not done
    std::size_t expected = 0;  // arrivals that callbacks reported and that were not taken
  };

  // `wake` is called from any thread, at most once until the next collect().
  explicit ReadyList(std::function<void()> wake) : wake_(std::move(wake)) {}
  ReadyList(const ReadyList&) = delete;
  ReadyList& operator=(const ReadyList&) = delete;

  // Loop's thread. Entities acquire and release their own. `own`: the bits that the entity does.
  Slot* acquire(Entity* entity, std::uint32_t own);
  void release(Slot* slot);
  // The loop starts collecting, so the next mark wakes it again. Marked entities get a turn.
  void collect();
  // Gives the next entity its turn: one step, whose result is returned.
  std::optional<Input> step(Batch& batch);
  // Whether no entity waits for a turn.
  [[nodiscard]] bool idle() const { return turns_.empty(); }

  // Any thread; never throws, never allocates.
  static void mark(Slot* slot, std::uint32_t bit) noexcept;
  void wake() noexcept;

  // For rcl: `slot` is the user data.
  static void on_message(const void* slot, std::size_t count) noexcept;
  static void on_counted(const void* slot, std::size_t count) noexcept;
  static void on_lost(const void* slot, std::size_t count) noexcept;
  static void on_incompatible(const void* slot, std::size_t count) noexcept;

 private:
  std::function<void()> wake_;
  std::atomic<bool> woken_{false};
  std::mutex mutex_;           // guards marked_
  std::vector<Slot*> marked_;  // each slot at most once; its capacity is the number of slots
  std::deque<Slot> slots_;
  std::vector<Slot*> free_;
  std::deque<Slot*> turns_;
};

}  // namespace connect_bridge::ros
