#include "ros/entities/ready_list.hpp"

namespace connect_bridge::ros {

ReadyList::Slot* ReadyList::acquire(void* owner, std::uint32_t kind) {
  if (free_.empty()) {
    Slot& slot = slots_.emplace_back();
    slot.list = this;
    free_.push_back(&slot);
    const std::lock_guard lock(mutex_);
    marked_.reserve(slots_.size());
  }
  Slot* slot = free_.back();
  free_.pop_back();
  slot->kind = kind;
  slot->bits_of_turn = 0;
  slot->owner = owner;
  return slot;
}

void ReadyList::release(Slot* slot) {
  slot->owner = nullptr;
  slot->bits_of_turn = 0;
  free_.push_back(slot);
}

void ReadyList::collect(std::deque<Slot*>& turns) {
  woken_.store(false);
  const std::lock_guard lock(mutex_);
  for (Slot* slot : marked_) {
    // From here on a new mark puts the slot into marked_ again, where it now finds room.
    slot->bits_of_turn |= slot->bits.exchange(0);
    if (slot->owner == nullptr || slot->in_turn) continue;
    slot->in_turn = true;
    turns.push_back(slot);
  }
  marked_.clear();
}

void ReadyList::mark(Slot* slot, std::uint32_t bit) noexcept {
  ReadyList& list = *slot->list;
  if (slot->bits.fetch_or(bit) == 0) {
    const std::lock_guard lock(list.mutex_);
    list.marked_.push_back(slot);
  }
  list.wake();
}

void ReadyList::wake() noexcept {
  if (!woken_.exchange(true)) wake_();
}

namespace {

void mark_const(const void* slot, std::uint32_t bit) noexcept {
  // rcl carries the user data of callbacks as const.
  ReadyList::mark(static_cast<ReadyList::Slot*>(const_cast<void*>(slot)), bit);
}

}  // namespace

void ReadyList::on_message(const void* slot, std::size_t) noexcept {
  mark_const(slot, kReadyMessage);
}
void ReadyList::on_counted(const void* slot, std::size_t count) noexcept {
  static_cast<Slot*>(const_cast<void*>(slot))->waiting.fetch_add(count);
  mark_const(slot, kReadyMessage);
}
void ReadyList::on_lost(const void* slot, std::size_t) noexcept {
  mark_const(slot, kReadyLost);
}
void ReadyList::on_incompatible(const void* slot, std::size_t) noexcept {
  mark_const(slot, kReadyIncompatible);
}

}  // namespace connect_bridge::ros
