// Decides which events of the audit log get a line of their own.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/base/pace.hpp"
#include "core/base/time.hpp"
#include "core/ports/audit.hpp"

namespace connect_bridge {

// Peers cause most lines, as often as they like. Equal events within ten seconds are counted, and
// written as one line at the end of that time. Different lines are limited in rate: for each
// identity, and for all peers without a login together. Lines beyond that are lost and counted. So
// nobody can quickly fill the disk, or displace the lines of others from the files. Pure; not
// thread-safe.
class AuditBook {
 public:
  static constexpr Duration kRepeatTime = std::chrono::seconds(10);
  static constexpr int kStrangersAtOnce = 100;  // then one in two seconds
  static constexpr int kIdentityAtOnce = 5000;  // then ten a second: a link may have 4096 channels
  static constexpr std::size_t kRepeatsMax = 1024;     // different lines that are watched
  static constexpr std::size_t kIdentitiesMax = 1024;  // beyond these they share one pace

  struct Entry {
    Audit audit;
    std::chrono::system_clock::time_point time;
    TimePoint at;  // the same moment by the steady clock
  };

  // The text to write for this event; may be empty.
  [[nodiscard]] std::string add(const Entry& whole);
  // The lines of counted events that are due. `all`: everything that is left, at the end.
  [[nodiscard]] std::string take_due(TimePoint now, bool all = false);
  // Lines that came too fast, in all.
  [[nodiscard]] std::uint64_t lost() const { return lost_; }

 private:
  struct Repeat {
    Entry first;
    std::uint64_t times = 0;  // beyond the first
  };
  [[nodiscard]] bool admits(const Entry& entry, TimePoint now);
  [[nodiscard]] Pace& pace_of(const Entry& entry);

  std::map<std::string, Repeat> repeats_;  // by the line without its time
  std::map<std::string, Pace> paces_;      // by identity
  Pace strangers_{kStrangersAtOnce, std::chrono::seconds(2)};
  Pace others_{kIdentityAtOnce, std::chrono::milliseconds(100)};
  std::uint64_t lost_ = 0;
  std::uint64_t lost_untold_ = 0;
};

}  // namespace connect_bridge
