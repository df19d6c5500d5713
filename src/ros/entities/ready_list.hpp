// The entities that have work to do. Callbacks of the middleware mark them on any thread, and the
// loop gives them turns.
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

// The kinds of work, as bits.
enum ReadyBit : std::uint32_t {
  kReadyMessage = 1,       // samples, requests, responses or a graph can be taken
  kReadyLost = 2,          // event: a message was lost
  kReadyIncompatible = 4,  // event: incompatible QoS
  kReadyFailed = 8,        // samples could not be published
  kReadyChanged = 16,      // the graph has changed
  kReadyLook = 32,         // the graph is to be looked at again
};

// Work of the entities since the loop began to drain them.
struct Batch {
  int steps = 0;  // each step counts, even an empty one: no entity can hold the loop
  std::size_t bytes = 0;
};

// Callbacks hold the address of a Slot. Slots are recycled, and freed only with the list. A mark
// for a destroyed entity may reach the next entity in the slot: only marks of that entity's own
// kinds count, and at worst it finds nothing to do.
class ReadyList {
 public:
  struct Slot {
    ReadyList* list = nullptr;
    std::atomic<std::uint32_t> bits{0};   // marked and not collected yet
    std::atomic<std::size_t> counted{0};  // arrivals that on_counted() reported
    // Used by the loop's thread only:
    Entity* entity = nullptr;  // nullptr: free
    std::uint32_t own = 0;     // bits that the entity handles
    bool in_turn = false;      // is in turns_
    std::uint32_t to_do = 0;   // collected bits that are not done
    std::size_t expected = 0;  // reported arrivals that were not taken yet
  };

  // `wake` is called from any thread, at most once until the next collect().
  explicit ReadyList(std::function<void()> wake) : wake_(std::move(wake)) {}
  ReadyList(const ReadyList&) = delete;
  ReadyList& operator=(const ReadyList&) = delete;

  // Called by entities for themselves, on the loop's thread. `own`: the bits that the entity
  // handles.
  Slot* acquire(Entity* entity, std::uint32_t own);
  void release(Slot* slot);
  // Collects the marks and gives marked entities a turn. The next mark wakes the loop again.
  void collect();
  // Gives the next entity its turn, and returns the result of its one step.
  std::optional<Input> step(Batch& batch);
  // True if no entity waits for a turn.
  [[nodiscard]] bool idle() const { return turns_.empty(); }

  // Any thread; never throws, never allocates.
  static void mark(Slot* slot, std::uint32_t bit) noexcept;
  void wake() noexcept;

  // Callbacks for rcl: `slot` is the user data.
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
