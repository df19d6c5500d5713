// The life of a link: when it was opened and lost, and when its parts end.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "core/base/time.hpp"
#include "core/base/timers.hpp"

namespace connect_bridge {

// The consequence of a connection's end for the link that it carried.
enum class Loss : std::uint8_t {
  kBreak,    // the link is dead after dead_after of silence, and may return
  kRestart,  // the same, but the peer will remember nothing
  kSilence,  // the link is dead at once, and may return
  kEnd,      // the link is dead at once, and for ever
};
[[nodiscard]] inline bool is_dead(Loss loss) {
  return loss == Loss::kSilence || loss == Loss::kEnd;
}

// A link is open on a connection, then lost. A lost link is dead after some silence: its calls and
// mirrors end. Backlogs for the peer's return wait longer, until the link is forgotten. On another
// connection the link is open again, whatever of this has happened. LinkLife knows the times.
// `Links`, which owns the links, makes the transitions and reports them to its user.
// Single-threaded.
class LinkLife {
 public:
  // `resume_for`: time for which messages of a lost connection are kept; zero: none are kept.
  explicit LinkLife(Duration resume_for) : resume_for_(resume_for) {}
  // Sets the time for breaks that begin from now on, and for messages that a break has left. At
  // zero nothing resumes any more after the break under way.
  void set_resume_for(Duration resume_for) { resume_for_ = resume_for; }

  // ---- transitions
  void opened(const Now& now) {
    ++connects_;
    opened_at_ = now.steady;
    offers_end_at_ = now.steady + kOffersTime;
    dead_at_.reset();
    forgotten_at_.reset();
    outlasted_ = false;
  }
  // `silent_at`: when a peer that may return counts as gone, by its last sign of life.
  void lost(Loss loss, TimePoint silent_at, const Now& now) {
    offers_end_at_.reset();
    may_return_ = loss == Loss::kBreak || loss == Loss::kSilence;
    dead_at_ = is_dead(loss) ? now.steady : std::max(now.steady, silent_at);
    forgotten_at_ = may_return_ ? std::max(*dead_at_, kept_until(now)) : dead_at_;
  }
  // Calls and mirrors have ended. Unless something resumes, the link is to be forgotten at once.
  void died(bool resumes, const Now& now) {
    dead_at_.reset();
    if (!resumes) forgotten_at_ = now.steady;
  }
  // The peer of a lost link may not return: the rest of the link is to end at once.
  void give_up(const Now& now) {
    may_return_ = false;
    if (dead_at_) dead_at_ = now.steady;
    forgotten_at_ = now.steady;
  }
  // Nothing of the link is left. `resumes`: until now there was something to resume.
  void forgotten(bool resumes) {
    outlasted_ = resumes;
    forgotten_at_.reset();
  }

  // The time for offers is over; true once for each connection.
  [[nodiscard]] bool take_offers_end(const Now& now) {
    if (!offers_end_at_ || *offers_end_at_ > now.steady) return false;
    offers_end_at_.reset();
    return true;
  }
  [[nodiscard]] bool is_to_die(const Now& now) const { return dead_at_ && *dead_at_ <= now.steady; }
  [[nodiscard]] bool is_to_be_forgotten(const Now& now) const {
    return forgotten_at_ && *forgotten_at_ <= now.steady;
  }
  [[nodiscard]] std::optional<TimePoint> deadline() const {
    return earliest(earliest(dead_at_, forgotten_at_), offers_end_at_);
  }

  // Number of connections that have carried the link.
  [[nodiscard]] std::uint64_t connects() const { return connects_; }
  // When the last connection was opened, and (below) for how long it has been open.
  [[nodiscard]] TimePoint opened_at() const { return opened_at_; }
  [[nodiscard]] Duration open_for(const Now& now) const { return now.steady - opened_at_; }
  // Lost, and not forgotten yet.
  [[nodiscard]] bool waits() const { return forgotten_at_.has_value(); }
  // Lost, and calls and mirrors wait, too.
  [[nodiscard]] bool waits_alive() const { return dead_at_.has_value(); }
  // Lost: the peer has not ended, so that kept messages may resume.
  [[nodiscard]] bool may_return() const { return may_return_; }
  // The last break was longer than messages were kept for it; until the link is open again.
  [[nodiscard]] bool outlasted() const { return outlasted_; }

  // ---- messages kept for a return
  [[nodiscard]] bool keeps() const { return resume_for_ > Duration::zero(); }
  // The time until which messages lost now are kept.
  [[nodiscard]] TimePoint kept_until(const Now& now) const { return now.steady + resume_for_; }

 private:
  // Time for the first round of offers after a connection was opened. Channels of the former
  // connection that the peer has not offered again by then end.
  static constexpr Duration kOffersTime = std::chrono::seconds(30);

  Duration resume_for_;
  std::uint64_t connects_ = 0;
  TimePoint opened_at_{};
  std::optional<TimePoint> offers_end_at_;  // open
  std::optional<TimePoint> dead_at_;        // lost
  std::optional<TimePoint> forgotten_at_;   // lost, or dead
  bool may_return_ = false;
  bool outlasted_ = false;
};

}  // namespace connect_bridge
