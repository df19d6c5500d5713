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

// For the requests or the responses of a service: one message in memory, which rcl takes into and
// sends from, and the same as bytes (CDR with its 4-byte header). An interface, because types that
// are not installed are carried as bytes only (bare_form.hpp). Thread: the loop's.
class MessageForm {
 public:
  MessageForm() = default;
  virtual ~MessageForm() = default;
  MessageForm(const MessageForm&) = delete;
  MessageForm& operator=(const MessageForm&) = delete;

  // The message for rcl; its content stays until the next call that changes it.
  [[nodiscard]] virtual void* message() = 0;
  // The message as bytes; an error text, or nothing.
  virtual std::optional<std::string> write_to(rmw_serialized_message_t& bytes) = 0;
  // The message from untrusted bytes, which must live until reset(); an error text, or nothing.
  // Takes at most `memory_max` of memory in addition to the message itself.
  virtual std::optional<std::string> read_from(ByteView bytes, std::size_t memory_max) = 0;
  // The content is not needed any longer: frees large parts. Needed
  // before the next message comes (see Middleware::fills_used_messages).
  virtual void reset() = 0;
};

// The form of a message whose package is installed. nullptr: its introspection is not there.
std::unique_ptr<MessageForm> installed_form(const rosidl_message_type_support_t* type);

}  // namespace connect_bridge::ros
