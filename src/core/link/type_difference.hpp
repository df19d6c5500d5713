// The line of the log about a type that has one definition here and another one at a peer.
#pragma once

#include <string>

#include "core/link/link.hpp"
#include "core/ports/outputs.hpp"

namespace connect_bridge {

struct TypeDifference {
  std::string what;  // "/pose of /talker"
  std::string type;  // "geometry_msgs/msg/Pose"
  std::string hash_here, hash_there;
  bool used = false;  // the rules use it nevertheless (allow_type_mismatch)
};

// Says it once for each type and hash of an identity, however many topics and services have the
// type; that it is used nevertheless is another line.
void log_difference(Outputs& outputs, const Link& link, const TypeDifference& difference);

}  // namespace connect_bridge
