// The clock with the date: for the expiry of tokens and certificates.
#pragma once

#include <chrono>

#include "core/base/time.hpp"

namespace connect_bridge {

[[nodiscard]] inline Stamp system_now() {
  return Duration(std::chrono::system_clock::now().time_since_epoch()).count();
}

}  // namespace connect_bridge
