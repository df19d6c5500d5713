// Whether a link carries enough exact samples of a topic.
#pragma once

#include <optional>

#include "core/base/time.hpp"

namespace connect_bridge {

// Samples stay exact as long as the link carries five of them in a second, or half of those that
// are published: programs that measure in them must not notice the bridge. Belongs to one offer;
// single-threaded.
class ExactFit {
 public:
  // A sample is published.
  void came(TimePoint now);
  // Seconds between samples, their mean; 0: too few have come to know.
  [[nodiscard]] double interval() const { return interval_; }

  // Would the link carry so few exact ones in a second that a rate which is only nearly known says
  // enough?
  [[nodiscard]] bool falls_far_short(double exact) const;
  // Are samples exact from now on? `exact`: that the link would carry in a second; 0: not known.
  // `is_shown`: by the topic's own messages, not only assumed.
  bool judge(double exact, bool is_shown, TimePoint now);
  [[nodiscard]] bool is_exact() const { return exact_; }

  static constexpr double kEnoughPerSecond = 5;
  static constexpr double kShareOfPublished = 0.5;
  static constexpr double kFarShort = 0.25;
  static constexpr double kExactMargin = 1.5;
  static constexpr Duration kExactAfter = std::chrono::seconds(5);
  // A try that failed doubles the time to the next one, up to 16 times.
  static constexpr Duration kTry = std::chrono::seconds(30);
  static constexpr int kTimesMax = 16;

 private:
  // Samples per second that are enough; nothing: too few have come to know.
  [[nodiscard]] std::optional<double> enough() const;

  std::optional<TimePoint> last_;
  double interval_ = 0;
  bool exact_ = true;
  std::optional<TimePoint> fits_since_;   // exact ones would, with the margin
  std::optional<TimePoint> exact_since_;  // again
  int times_ = 1;                         // kExactAfter
};

}  // namespace connect_bridge
