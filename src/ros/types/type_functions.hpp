// The functions of a type support that read and write a message's bytes.
#pragma once

#include <rmw/serialized_message.h>
#include <rosidl_runtime_c/message_type_support_struct.h>
#include <rosidl_typesupport_fastrtps_cpp/message_type_support.h>

#include "core/base/bytes.hpp"

namespace connect_bridge::ros {

// Does the work of rmw_serialize and rmw_deserialize in rmw_fastrtps_cpp and rmw_zenoh_cpp. These
// repeat two steps for each message: they look up the functions in the type's library (two
// symbols), and make an object for the type. Thread: any, with a message of its own.
class TypeFunctions {
 public:
  // Usable only if the middleware itself uses these functions, and the type has them.
  explicit TypeFunctions(const rosidl_message_type_support_t& type);

  [[nodiscard]] explicit operator bool() const { return functions_ != nullptr; }

  // Writes CDR with its 4-byte header, in the byte order of this machine. False: the message cannot
  // be written, or there is no memory.
  [[nodiscard]] bool write(const void* message, rmw_serialized_message_t& bytes) const;
  // Reads CDR with its header. False: the bytes are not such a message; `message` holds the part
  // that was read.
  [[nodiscard]] bool read(ByteView bytes, void* message) const;

 private:
  const message_type_support_callbacks_t* functions_ = nullptr;
};

}  // namespace connect_bridge::ros
