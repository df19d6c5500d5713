// Whether more is published on a channel than its link carries.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "core/base/time.hpp"

namespace connect_bridge {

// Judged by time and not by count (CoDel, RFC 8289): a queue stands if for an interval even the
// shortest wait in it was too long, while more came than left. A burst that is over stands in no
// way, however long: all of it may wait. Belongs to a channel's queue, which reports what happens.
class Overload {
 public:
  // A message comes, and others wait, the oldest of them since `oldest`.
  void came(TimePoint oldest, TimePoint now) {
    ++came_;
    if (!late_since_ && now - oldest > target()) {
      late_since_ = oldest + target();
      came_ = 1;
      left_ = 0;
    }
    if (late_since_ && now - *late_since_ >= interval() && came_ > left_) stands_ = true;
  }
  // A message takes the place of one that waits.
  void replaced() { calm_since_.reset(); }
  // One that waited since `since` begins to leave.
  void began(TimePoint since, TimePoint now) {
    ++left_;
    if (now - since > target()) {
      calm_since_.reset();
    } else if (!stands_) {
      late_since_.reset();
    } else if (!calm_since_) {
      calm_since_ = now;
    } else if (now - *calm_since_ >= interval()) {
      over();
    }
  }
  // A message of this size has left; `took`: from its first part to its last.
  void sent(Duration took, std::uint64_t bytes) {
    before_ = last_.value_or(took);
    last_ = took;
    if (took < kTellingTime) {
      quick_ = true;
      rate_before_ = rate_ = 0;
    } else {
      if (rate_ > 0) quick_ = false;
      rate_before_ = rate_;
      rate_ = static_cast<double>(bytes) / std::chrono::duration<double>(took).count();
    }
  }
  // Nothing waits and nothing is under way: the link keeps up.
  void over() {
    stands_ = false;
    late_since_.reset();
    calm_since_.reset();
  }

  [[nodiscard]] bool stands() const { return stands_; }
  // The time since messages are late, while it stands; 0: it does not stand.
  [[nodiscard]] Duration stood(TimePoint now) const {
    return stands_ && late_since_ ? now - *late_since_ : Duration::zero();
  }
  // While it stands: of so many that came one has left. Else 1.
  [[nodiscard]] double came_for_each() const {
    return stands_
               ? static_cast<double>(came_) / static_cast<double>(std::max<std::uint64_t>(left_, 1))
               : 1.0;
  }

  // Bytes per second of its messages, from first part to last: the channel's share of the link, by
  // the quicker one of the last two. 0: they leave too quickly to tell, or only one has told. One
  // tells by itself if it took long and none was quick before: else the path stood still.
  [[nodiscard]] double rate() const {
    const bool shown = rate_before_ > 0 || (!quick_ && last_ && *last_ >= kSurelyTelling);
    return shown ? std::max(rate_, rate_before_) : 0;
  }

  // Messages have left too quickly to tell a rate, and no slow ones came after them.
  [[nodiscard]] bool is_quick() const { return quick_; }

  static constexpr Duration kTellingTime = std::chrono::milliseconds(20);
  static constexpr Duration kSurelyTelling = std::chrono::seconds(1);
  static constexpr Duration kTargetMin = std::chrono::milliseconds(50);
  static constexpr Duration kIntervalMin = std::chrono::milliseconds(100);

 private:
  // How long a message takes. Of two: one alone may have been under way while the path stood still.
  [[nodiscard]] Duration message_time() const {
    return last_ ? std::min(*last_, before_) : Duration::zero();
  }
  [[nodiscard]] Duration target() const { return kTargetMin + message_time() / 2; }
  [[nodiscard]] Duration interval() const { return std::max(kIntervalMin, 2 * message_time()); }

  std::optional<Duration> last_;
  double rate_ = 0;
  double rate_before_ = 0;
  Duration before_{};
  std::optional<TimePoint> late_since_;  // every wait since then was above the target
  std::uint64_t came_ = 0;               // since then
  std::uint64_t left_ = 0;
  bool stands_ = false;
  bool quick_ = false;  // one left too quickly to tell, and no two have told since then
  std::optional<TimePoint> calm_since_;  // it stands, but since then nothing waited long
};

}  // namespace connect_bridge
