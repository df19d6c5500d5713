// Random numbers and ids.
#pragma once

#include <cstdint>
#include <functional>

#include "core/base/ids.hpp"
#include "core/base/time.hpp"

namespace connect_bridge {

// A small seeded generator (splitmix64). Not for secrets: its seed determines every number.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ULL);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
  }
  // Uniform in [0, n); n > 0.
  std::uint64_t below(std::uint64_t n) { return next() % n; }

 private:
  std::uint64_t state_;
};

// Sixteen bytes, from `secret_random` if it is given (for what nobody may guess), else from
// `random`.
inline Token128 make_token(Random& random,
                           const std::function<std::uint64_t()>& secret_random = {}) {
  Token128 token;
  for (std::size_t i = 0; i < token.bytes.size(); i += 8) {
    const std::uint64_t word = secret_random ? secret_random() : random.next();
    for (std::size_t j = 0; j < 8; ++j)
      token.bytes[i + j] = static_cast<std::uint8_t>(word >> (8 * j));
  }
  return token;
}

// The id of a process: when it started (ms of the system clock), then ten random bytes. So of two
// the earlier one is smaller, as long as their clocks agree.
inline Token128 make_side_id(Random& random, Stamp started) {
  Token128 id = make_token(random);
  auto ms = static_cast<std::uint64_t>(started / 1'000'000);
  for (std::size_t i = 6; i-- > 0; ms >>= 8) id.bytes[i] = static_cast<std::uint8_t>(ms);
  return id;
}

}  // namespace connect_bridge
