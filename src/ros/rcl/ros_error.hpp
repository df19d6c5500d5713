// The exception of a start that fails.
#pragma once

#include <stdexcept>

namespace connect_bridge::ros {

// The start failed: the arguments are wrong or the middleware does not start. Thrown by the
// constructors of Node, Gateway and ParameterServer, and never later.
class RosError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace connect_bridge::ros
