// The memory that a serialized message is taken into.
#pragma once

#include <rmw/serialized_message.h>

#include <memory>

#include "core/base/bytes.hpp"

namespace connect_bridge::ros {

// A buffer that rmw grows to the size of the message and that then belongs to a Payload. Kept over
// takes that find nothing.
class TakeBuffer {
 public:
  // Ready to take into; allocates only if the last one was given away.
  rmw_serialized_message_t* prepare();
  // The message becomes a payload, without copying its bytes.
  Payload give_away();

 private:
  struct Owned;
  std::shared_ptr<Owned> owned_;
};

// The structure in which rmw is given bytes to read.
[[nodiscard]] rmw_serialized_message_t as_serialized(ByteView bytes);

}  // namespace connect_bridge::ros
