// CONNECT_CHECK: a condition that only our own bug can break. On in every build. Input from a peer
// must never reach one.
#pragma once

#include <cstdio>
#include <cstdlib>

namespace connect_bridge {

[[noreturn]] inline void check_failed(const char* condition, const char* file, int line) {
  std::fprintf(stderr, "connect_bridge: bug at %s:%d: %s does not hold\n", file, line, condition);
  std::abort();
}

}  // namespace connect_bridge

#define CONNECT_CHECK(condition) \
  ((condition) ? void() : ::connect_bridge::check_failed(#condition, __FILE__, __LINE__))
