// Whether more is published on a channel than its link carries.
#pragma once

#include <cstdint>

#include "core/base/time.hpp"

namespace connect_bridge {

// If camera images are published faster than the link carries them, some of them are lost in any
// case. If as many as fit waited, each would be late by what the others take; so only the newest of
// a publisher waits then. One burst is no overload, however large: what fits of it may all wait.
class Overload {
 public:
  // A message was sent, in this time from its first part to its last. A single slow one may have
  // been under way while the path stood still.
  void sent(Duration took) { slow_ = drops_ && took > kSlow ? slow_ + 1 : 0; }
  // Something was dropped for want of room.
  void dropped() { drops_ = true; }
  // Nothing waits and nothing is under way: the link keeps up.
  void emptied() { *this = {}; }

  // Whether only the newest message of each publisher should wait.
  [[nodiscard]] bool newest_only() const { return slow_ >= 2; }

  static constexpr Duration kSlow = std::chrono::milliseconds(100);

 private:
  bool drops_ = false;      // since the queue was last empty
  std::uint64_t slow_ = 0;  // messages in a row that were slow, since then
};

}  // namespace connect_bridge
