// Which entities have something to do: marked by middleware callbacks on any thread, read by the
// loop.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <vector>

namespace connect_bridge::ros {

// What a callback can report, as bits.
enum ReadyBit : std::uint32_t {
  kReadyMessage = 1,       // samples or requests wait
  kReadyLost = 2,          // event: message lost
  kReadyIncompatible = 4,  // event: incompatible QoS
  kReadyChanged = 8,       // the graph has changed
  kReadyLook = 16,         // the time has come to look at it again
};

// Callbacks hold the address of a Slot. Slots are recycled and never freed before the list, so a
// callback that comes late at worst marks an entity that has nothing to do.
class ReadyList {
 public:
  struct Slot {
    ReadyList* list = nullptr;
    std::atomic<std::uint32_t> bits{0};
    std::atomic<std::size_t> waiting{0};  // what on_counted() was told; for the owner to take
    // Of the loop's thread:
    void* owner = nullptr;           // nullptr: free
    std::uint32_t kind = 0;          // the owner's meaning
    bool in_turn = false;            // stands in the owner's queue of turns
    std::uint32_t bits_of_turn = 0;  // what is left to do
  };

  explicit ReadyList(std::function<void()> wake) : wake_(std::move(wake)) {}
  ReadyList(const ReadyList&) = delete;
  ReadyList& operator=(const ReadyList&) = delete;

  // Loop's thread.
  Slot* acquire(void* owner, std::uint32_t kind);
  void release(Slot* slot);
  // The loop begins to look: the next mark wakes it again. Appends the marked slots that have an
  // owner to the queue of turns, each once.
  void collect(std::deque<Slot*>& turns);

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
};

}  // namespace connect_bridge::ros
