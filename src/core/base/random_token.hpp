// Random ids and secrets.
#pragma once

#include <cstdint>
#include <functional>

#include "core/base/ids.hpp"
#include "core/base/random.hpp"

namespace connect_bridge {

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

}  // namespace connect_bridge
