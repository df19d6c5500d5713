// One message of a type that is known at run time: its memory, and its serialization.
#pragma once

#include <rmw/serialized_message.h>
#include <rosidl_runtime_c/message_type_support_struct.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "core/base/bytes.hpp"

namespace connect_bridge::ros {

// One request or response in memory, which rcl takes into and sends from, and the same message as
// bytes (CDR with its 4-byte header). An interface, because types that are not installed are
// forwarded only as bytes (bare_form.hpp). Thread: the loop's.
class MessageForm {
 public:
  MessageForm() = default;
  virtual ~MessageForm() = default;
  MessageForm(const MessageForm&) = delete;
  MessageForm& operator=(const MessageForm&) = delete;

  // The message for rcl; its content stays until the next call that changes it.
  [[nodiscard]] virtual void* message() = 0;
  // Writes the message as bytes. Returns an error text; nullopt: none.
  virtual std::optional<std::string> write_to(rmw_serialized_message_t& bytes) = 0;
  // Reads the message from untrusted bytes, which must live until reset(). Uses at most
  // `memory_max` bytes of memory in addition to the message itself. Returns an error text; nullopt:
  // none.
  virtual std::optional<std::string> read_from(ByteView bytes, std::size_t memory_max) = 0;
  // Drops the content, and frees large parts of it. Call it before the next message is taken (see
  // Middleware::fills_used_messages).
  virtual void reset() = 0;
};

// The form of a message whose package is installed. nullptr: there is no introspection for it.
std::unique_ptr<MessageForm> installed_form(const rosidl_message_type_support_t* type);

}  // namespace connect_bridge::ros
