// Work on tables that takes several steps where they are long.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>

namespace connect_bridge {

// The work has parts, a table each, which are done in order. A step may do so much, and the next
// one goes on behind it. Entries are counted, not timed, so the same inputs give the same actions.
struct Course {
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
  // One more entry may be done in this step.
  [[nodiscard]] bool take() { return left > 0 && left-- > 0; }
  // The last entry has taken as long as so many more.
  void charge(std::size_t entries) { left -= std::min(left, entries); }
  // Does entries of a table that is ordered by names. True: all of them are done.
  template <class Table, class Entry>
  [[nodiscard]] bool each(Table& table, Entry entry) {
    for (auto at = table.upper_bound(last); at != table.end();) {
      if (!take()) return false;
      last = at->first;
      entry((at++)->second);
    }
    return true;
  }

  std::size_t left = kAll;  // entries that may be done in this step
  int parts = 0;            // those that are over
  Name last = {};           // the entry of the present part that was done last
};

}  // namespace connect_bridge
