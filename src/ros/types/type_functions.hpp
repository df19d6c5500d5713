// The functions of a type support that read and write a message's bytes.
#pragma once

#include <rmw/serialized_message.h>
#include <rosidl_runtime_c/message_type_support_struct.h>
#include <rosidl_typesupport_fastrtps_cpp/message_type_support.h>

#include "core/base/bytes.hpp"

namespace connect_bridge::ros {

// What rmw_serialize and rmw_deserialize do with rmw_fastrtps_cpp and rmw_zenoh_cpp, without what
// these do again for each message: to look for the functions in the type's library (two look-ups of
// a symbol), and to make an object for the type. Thread: any, with a message of its own.
class TypeFunctions {
 public:
  // Usable only where the middleware itself uses these functions, and the type has them.
  explicit TypeFunctions(const rosidl_message_type_support_t& type);

  [[nodiscard]] explicit operator bool() const { return functions_ != nullptr; }

  // As CDR with its 4-byte header, in the byte order of this machine. False: the message cannot be
  // written, or there is no memory.
  [[nodiscard]] bool write(const void* message, rmw_serialized_message_t& bytes) const;
  // From CDR with its header. False: the bytes are not such a message; what of it was read is in
  // `message`.
  [[nodiscard]] bool read(ByteView bytes, void* message) const;

 private:
  const message_type_support_callbacks_t* functions_ = nullptr;
};

}  // namespace connect_bridge::ros
