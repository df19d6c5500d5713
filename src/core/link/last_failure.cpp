#include "core/link/last_failure.hpp"

#include <utility>

namespace connect_bridge {
namespace {

// "20 min", "3 h", "4 days"
std::string long_time(Duration time) {
  constexpr int kHour = 60;
  constexpr int kDay = 24 * kHour;
  const auto minutes = std::chrono::duration_cast<std::chrono::minutes>(time).count();
  if (minutes < 2 * kHour) return std::to_string(minutes) + " min";
  if (minutes < 2 * kDay) return std::to_string(minutes / kHour) + " h";
  return std::to_string(minutes / kDay) + " days";
}

bool is_of_certificate(Cause cause) {
  return cause == Cause::kCertificateForeign || cause == Cause::kCertificateName ||
         cause == Cause::kCertificatePurpose || cause == Cause::kCertificateEarly ||
         cause == Cause::kCertificateExpired || cause == Cause::kOtherKey;
}

}  // namespace

void LastFailure::set(Failure why, const Now& now) {
  if (!since_) since_ = now.steady;
  if (why != last_) {
    before_ = std::exchange(last_, std::move(why));
    before_until_ = now.steady + kTurn;
  }
  next_ = now.steady + (now.steady - *since_ < kFirstPeriod ? kFirstPeriod : kPeriod);
  logged_ = true;
}

void LastFailure::tell(Line line, const Now& now) {
  if (is_of_certificate(line.why.cause)) certified_until_ = now.steady + kPeriod;
  if (line.why.cause == Cause::kRobotNotAtRelay && is_of_certificate(last_.cause) &&
      now.steady < certified_until_)
    return;
  if (line.why == before_ && now.steady < before_until_) {
    std::swap(last_, before_);
    before_until_ = now.steady + kTurn;
  }
  const bool same = line.why == last_;
  // A reason that was not logged and stays is logged the second time.
  const bool is_news = same ? !logged_ : news_ < kNews;
  if (!is_news && now.steady < next_) {
    if (!same) logged_ = false;
    last_ = line.why;
    return;
  }
  if (is_news) {
    ++news_;
  } else if (same) {
    news_ = 0;
  }
  set(line.why, now);
  if (is_news) {
    outputs_.log(line.level, line.what + line.why.text + line.hint);
  } else {
    outputs_.log(LogLevel::kWarn, "still cannot connect, for " + long_time(now.steady - *since_) +
                                      ": " + line.why.text + line.hint);
  }
}

}  // namespace connect_bridge
