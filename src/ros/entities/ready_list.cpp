#include "ros/entities/ready_list.hpp"

#include "ros/entities/entity.hpp"

namespace connect_bridge::ros {
namespace {

// The user data of rcl's callbacks is const.
ReadyList::Slot* slot_of(const void* user_data) {
  return static_cast<ReadyList::Slot*>(const_cast<void*>(user_data));
}

}  // namespace

ReadyList::Slot* ReadyList::acquire(Entity* entity, std::uint32_t own) {
  if (free_.empty()) {
    Slot& slot = slots_.emplace_back();
    slot.list = this;
    free_.push_back(&slot);
    const std::lock_guard lock(mutex_);
    marked_.reserve(slots_.size());
  }
  Slot* slot = free_.back();
  free_.pop_back();
  slot->counted.store(0);
  slot->expected = 0;
  slot->to_do = 0;
  slot->entity = entity;
  slot->own = own;
  return slot;
}

void ReadyList::release(Slot* slot) {
  slot->entity = nullptr;
  slot->own = 0;
  slot->to_do = 0;
  free_.push_back(slot);
}

void ReadyList::collect() {
  woken_.store(false);
  const std::lock_guard lock(mutex_);
  for (Slot* slot : marked_) {
    // A new mark puts the slot into marked_ again from now on; there is room for it.
    slot->to_do |= slot->bits.exchange(0) & slot->own;
    if (slot->to_do == 0 || slot->in_turn) continue;
    slot->in_turn = true;
    turns_.push_back(slot);
  }
  marked_.clear();
}

std::optional<Input> ReadyList::step(Batch& batch) {
  ++batch.steps;
  Slot& slot = *turns_.front();
  turns_.pop_front();
  slot.in_turn = false;
  // An entity may be destroyed, and its slot reused, before its turn comes.
  if (slot.entity == nullptr || slot.to_do == 0) return std::nullopt;
  auto input = slot.entity->step(batch);
  if (slot.to_do != 0) {
    slot.in_turn = true;
    turns_.push_back(&slot);
  }
  return input;
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

void ReadyList::on_message(const void* slot, std::size_t) noexcept {
  mark(slot_of(slot), kReadyMessage);
}
void ReadyList::on_counted(const void* slot, std::size_t count) noexcept {
  slot_of(slot)->counted.fetch_add(count);
  mark(slot_of(slot), kReadyMessage);
}
void ReadyList::on_lost(const void* slot, std::size_t) noexcept {
  mark(slot_of(slot), kReadyLost);
}
void ReadyList::on_incompatible(const void* slot, std::size_t) noexcept {
  mark(slot_of(slot), kReadyIncompatible);
}

}  // namespace connect_bridge::ros
