// Whether more is published on a channel than its link carries.
#pragma once

#include <algorithm>

#include "core/base/time.hpp"

namespace connect_bridge {

// Who publishes camera images faster than the link carries them loses some of them in any case.
// Were as many to wait as fit, each would arrive late by what the others take; so only the newest
// waits then. A burst that the link carries in the end is no overload, and small messages are soon
// gone.
class Overload {
 public:
  // A message was sent, in this time from its first part to its last.
  void sent(Duration took) {
    took_before_ = took_;
    took_ = took;
  }
  // Something was dropped for want of room.
  void dropped() { drops_ = true; }
  // Nothing waits: the link keeps up.
  void emptied() { drops_ = false; }

  // Whether only the newest message should wait.
  [[nodiscard]] bool newest_only() const { return drops_ && std::min(took_, took_before_) > kSlow; }

  static constexpr Duration kSlow = std::chrono::milliseconds(100);

 private:
  bool drops_ = false;
  // Of two messages, because one that was under way while the path stood still tells nothing.
  Duration took_{}, took_before_{};
};

}  // namespace connect_bridge
