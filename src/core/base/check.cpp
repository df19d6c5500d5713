#include "core/base/check.hpp"

#include <cstdio>
#include <cstdlib>

namespace connect_bridge {

void check_failed(const char* condition, const char* file, int line) {
  std::fprintf(stderr, "connect_bridge: bug at %s:%d: %s does not hold\n", file, line, condition);
  std::abort();
}

}  // namespace connect_bridge
