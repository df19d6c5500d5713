// The end of what one link has told, which takes several steps where that is much.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "core/base/time.hpp"

namespace connect_bridge {

// Channels end with their connection, mirrors and calls with their link. Both ends have parts, a
// table each, which end in order. A step may end so many entries, and the next one goes on behind
// them. Entries are counted, not timed, so the same inputs give the same actions. Meanwhile a
// channel that has not ended is one whose peer is silent.
struct LinkEnd {
  static constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();
  using Name = std::pair<std::string, std::string>;  // of an entry: local name and type

  // Does the part, unless it is over. `work` returns whether it is over now. True: it is over, as
  // are those before it.
  template <class Work>
  bool part(int number, Work work) {
    if (number < parts) return true;
    if (!work()) return false;
    parts = number + 1;
    last = {};
    return true;
  }
  // One more entry may end in this step.
  [[nodiscard]] bool take() { return left > 0 && left-- > 0; }
  // Ends entries of a table that is ordered by names. True: all of them have ended.
  template <class Table, class Entry>
  [[nodiscard]] bool each(Table& table, Entry entry) {
    for (auto at = table.upper_bound(last); at != table.end();) {
      if (!take()) return false;
      last = at->first;
      entry((at++)->second);
    }
    return true;
  }

  std::optional<TimePoint> goes_on_at = {};  // none: nothing is ending
  TimePoint late_at = {};                    // from then on all that is left ends at once
  bool dies = false;                         // the link does, after its connection if it has one
  std::size_t left = kAll;                   // entries that may end in this step
  int parts = 0;                             // those that are over
  Name last = {};                            // the entry of the present part that ended last
};

}  // namespace connect_bridge
