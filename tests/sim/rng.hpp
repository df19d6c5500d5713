// The simulation's own random numbers: the same seed gives the same numbers on every machine.
#pragma once

#include <chrono>
#include <cstdint>
#include <vector>

#include "core/base/time.hpp"

namespace connect_bridge::sim {

// xoshiro256**, seeded through splitmix64. No distribution of the standard library is used anywhere
// in the simulation, because those differ between libraries.
class Rng {
 public:
  explicit Rng(std::uint64_t seed) {
    for (auto& word : state_) {
      seed += 0x9e3779b97f4a7c15ULL;
      std::uint64_t z = seed;
      z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
      z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
      word = z ^ (z >> 31);
    }
  }

  std::uint64_t next() {
    const std::uint64_t result = rotate(state_[1] * 5, 7) * 9;
    const std::uint64_t t = state_[1] << 17;
    state_[2] ^= state_[0];
    state_[3] ^= state_[1];
    state_[1] ^= state_[2];
    state_[0] ^= state_[3];
    state_[2] ^= t;
    state_[3] = rotate(state_[3], 45);
    return result;
  }

  // 0 to n - 1; n must not be 0. The bias of the modulo does not matter here.
  std::uint64_t below(std::uint64_t n) { return next() % n; }
  // lo to hi, both included.
  std::int64_t between(std::int64_t lo, std::int64_t hi) {
    return lo + static_cast<std::int64_t>(below(static_cast<std::uint64_t>(hi - lo) + 1));
  }
  Duration between(Duration lo, Duration hi) { return Duration{between(lo.count(), hi.count())}; }
  bool chance(unsigned permille) { return below(1000) < permille; }
  Rng fork() { return Rng{next()}; }

  template <class T>
  const T& pick(const std::vector<T>& from) {
    return from[below(from.size())];
  }

 private:
  static std::uint64_t rotate(std::uint64_t x, int k) { return (x << k) | (x >> (64 - k)); }

  std::uint64_t state_[4];
};

}  // namespace connect_bridge::sim
