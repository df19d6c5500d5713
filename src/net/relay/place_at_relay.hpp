// A server's place at its relay, for its status.
#pragma once

#include <string>

#include "core/base/time.hpp"
#include "core/ports/failure.hpp"

namespace connect_bridge {

struct PlaceAtRelay {
  std::string relay;          // as in listen.relay
  Stamp connected_since = 0;  // 0: not connected
  Failure failure;            // the last one; none: the server was never refused
};

}  // namespace connect_bridge
