// The end of what one link has told, which takes several steps where that is much.
#pragma once

#include <optional>

#include "core/base/course.hpp"
#include "core/base/time.hpp"

namespace connect_bridge {

// Channels end with their connection, mirrors and calls with their link. Meanwhile a channel that
// has not ended is one whose peer is silent.
struct LinkEnd : Course {
  std::optional<TimePoint> goes_on_at = {};  // none: nothing is ending
  TimePoint late_at = {};                    // from then on all that is left ends at once
  bool dies = false;                         // the link does, after its connection if it has one
};

}  // namespace connect_bridge
