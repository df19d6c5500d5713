#include "core/topics/cloud_form.hpp"

#include <algorithm>
#include <array>

namespace connect_bridge {
namespace {

constexpr std::array<std::uint32_t, 4> kSteps{1000, 2000, 5000, 10'000};
// Measured for clouds of lidars: a step of 1 mm makes 2.5 times less of an exact one, and each
// further step 1.2 times less.
constexpr double kFirstStep = 2.5;
constexpr double kFurtherStep = 1.2;
constexpr double kFilled = 0.8;  // of the rate; the rest is for clouds that are larger
constexpr double kFinerMargin = 1.2;

}  // namespace

std::uint32_t CloudForm::choose(const Facts& facts, TimePoint now) {
  const bool known = facts.rate > 0 && facts.exact_bytes > 0;
  const double exact = known ? facts.rate / facts.exact_bytes : 0;
  if (fit_.judge(exact, facts.is_shown, now)) return step_um_ = 0;
  if (known) step_um_ = fitting_step(facts);
  return step_um_;
}

std::uint32_t CloudForm::fitting_step(const Facts& facts) const {
  const std::uint32_t coarsest = std::max(2 * facts.error_um, 1U);
  const double room = kFilled * facts.rate * fit_.interval();
  double bytes = facts.exact_bytes / kFirstStep;
  for (const std::uint32_t step : kSteps) {
    if (step >= coarsest) break;
    bytes = facts.bytes_at(step).value_or(bytes);
    // A finer one than now only if it fits well: else the steps would alternate.
    const bool finer = step_um_ != 0 && step < step_um_;
    if (bytes * (finer ? kFinerMargin : 1) <= room) return step;
    bytes /= kFurtherStep;
  }
  return coarsest;
}

std::string_view CloudForm::because() const {
  return step_um_ == 0 ? "" : "the link would carry too few exact clouds";
}

}  // namespace connect_bridge
