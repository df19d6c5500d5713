// The memory for a serialized message that is taken.
#pragma once

#include <rmw/serialized_message.h>

#include <memory>

#include "core/base/bytes.hpp"

namespace connect_bridge::ros {

// A buffer that rmw enlarges to the size of the message, and that then belongs to a Payload. The
// buffer stays after a take that finds nothing.
class TakeBuffer {
 public:
  // Prepares the buffer for a take; allocates only if the last buffer was given away.
  rmw_serialized_message_t* prepare();
  // Turns the message into a payload, without copying its bytes.
  Payload give_away();

 private:
  struct Owned;
  std::shared_ptr<Owned> owned_;
};

// The structure in which rmw receives bytes to read.
[[nodiscard]] rmw_serialized_message_t as_serialized(ByteView bytes);

}  // namespace connect_bridge::ros
