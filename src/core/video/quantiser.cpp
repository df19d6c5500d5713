#include "core/video/quantiser.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace connect_bridge::video {
namespace {

// Steps of the AC coefficients by libvpx's index (its table of 64 indices, RFC 6386 section 14.1),
// from kBest to kWorst.
constexpr std::array<double, 25> kSteps{39, 41, 43, 45, 47, 49,  51,  53,  55,  57,  60,  64, 68,
                                        72, 78, 84, 90, 96, 102, 108, 114, 122, 131, 140, 149};
static_assert(kSteps.size() == QuantiserControl::kWorst - QuantiserControl::kBest + 1);

constexpr double kExponent = 1.25;  // measured on moving scenes
constexpr double kUp = 0.7;         // a picture too large makes the next one late
constexpr double kDown = 0.35;
// A delta that is finer than the picture before also makes up for what that one lacks.
constexpr double kByLast = 0.5;
constexpr double kSlack = 0.05;  // nearly as small as wanted is good enough
constexpr double kByDifference = 0.8;
// A moving scene with texture has these: 47 kB at 28 and 640x480 for a base, a third for a delta.
constexpr double kBaseOfPixels = 4.0;
constexpr double kBaseToDelta = -1.5;

double step_of(std::uint8_t quantiser) {
  return std::log2(kSteps[quantiser - QuantiserControl::kBest]);
}

double follow(double from, double to) {
  return from + (to > from ? kUp : kDown) * (to - from);
}

}  // namespace

QuantiserControl::QuantiserControl(std::uint64_t pixels)
    : base_(std::log2(static_cast<double>(pixels)) + kBaseOfPixels), delta_(base_ + kBaseToDelta) {}

double QuantiserControl::cost_of(bool base, std::uint8_t quantiser) const {
  const double step = step_of(quantiser);
  const double change = base || last_step_ <= 0 ? 0 : step - last_step_;
  return kExponent * step + kByLast * change;
}

double QuantiserControl::raised(bool base, double difference) const {
  if (base || ordinary_ <= 0 || difference <= ordinary_) return 0;
  return kByDifference * std::log2(difference / ordinary_);
}

std::uint8_t QuantiserControl::quantiser(bool base, double bytes, double difference) const {
  const double most = std::log2(std::max(bytes, 1.0));
  const double complexity = (base ? base_ : delta_) + raised(base, difference);
  std::uint8_t found = kBest;
  while (found < kWorst && complexity - cost_of(base, found) > most + kSlack) ++found;
  return found;
}

void QuantiserControl::made(bool base, std::uint8_t quantiser, double bytes, double difference) {
  const double seen = std::log2(std::max(bytes, 1.0)) + cost_of(base, quantiser);
  last_step_ = step_of(quantiser);
  if (base) {
    base_ = seen;
    if (!delta_known_) delta_ = seen + kBaseToDelta;
    return;
  }
  delta_ = follow(delta_, seen - raised(false, difference));
  delta_known_ = true;
  if (difference > 0) ordinary_ = ordinary_ > 0 ? follow(ordinary_, difference) : difference;
}

void QuantiserControl::scale(double times) {
  base_ += std::log2(times);
  delta_ += std::log2(times);
  last_step_ = ordinary_ = 0;
}

double QuantiserControl::bytes_at(bool base, std::uint8_t quantiser) const {
  return std::exp2((base ? base_ : delta_) - kExponent * step_of(quantiser));
}

}  // namespace connect_bridge::video
