// How the rate of a cellular link changes under way.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

namespace bench {

// Drawn from a seed: 1 to 40 Mbit/s, another rate every 100 ms, with stalls. Or recorded. Every run
// has the same drive.
class Drive {
 public:
  explicit Drive(std::uint64_t seed) : random_(seed) {}

  // A file of the Mahimahi form: a line for each 1500 bytes that can be carried, ms since the
  // begin; it begins again at its end. Throws std::runtime_error if there is nothing in it.
  static Drive recorded(const std::string& path) {
    constexpr std::size_t kMsMax = 10'000'000;
    Drive drive(0);
    drive.step_ = 1'000'000;
    drive.repeats_ = true;
    std::ifstream file(path);
    for (std::size_t ms = 0; file >> ms;) {
      if (ms > kMsMax) throw std::runtime_error("too long a drive: " + path);
      if (ms >= drive.rates_.size()) drive.rates_.resize(ms + 1);
      drive.rates_[ms] += 1500 * 8 * 1000.0;
    }
    if (drive.rates_.empty()) throw std::runtime_error("no recorded drive: " + path);
    return drive;
  }

  // How long a rate lasts, ns.
  [[nodiscard]] std::int64_t step() const { return step_; }

  // Bits per second at a time since the drive began, ns.
  double at(std::int64_t time_ns) {
    auto step = static_cast<std::size_t>(std::max<std::int64_t>(time_ns, 0) / step_);
    if (repeats_) step %= rates_.size();
    while (rates_.size() <= step) rates_.push_back(drawn());
    return rates_[step];
  }

 private:
  static constexpr double kLowest = 1e6, kHighest = 40e6;
  static constexpr double kStallsPerStep = 1.0 / 150;

  double drawn() {
    position_ += std::normal_distribution<double>(0, 0.35)(random_);  // octaves
    const double highest = std::log2(kHighest / kLowest);
    if (position_ < 0) position_ = -position_;
    if (position_ > highest) position_ = std::max(2 * highest - position_, 0.0);
    if (stalled_ == 0 && std::uniform_real_distribution<double>(0, 1)(random_) < kStallsPerStep) {
      stalled_ = std::uniform_int_distribution<int>(3, 10)(random_);
    }
    if (stalled_ > 0) return --stalled_, 0.0;
    return kLowest * std::exp2(position_);
  }

  std::mt19937_64 random_;
  std::int64_t step_ = 100'000'000;
  bool repeats_ = false;
  std::vector<double> rates_;
  double position_ = 3;  // log2 of the rate over the lowest
  int stalled_ = 0;      // steps that are left of a stall
};

}  // namespace bench
