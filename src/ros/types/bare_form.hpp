// Messages that are known only as bytes.
#pragma once

#include <rosidl_typesupport_fastrtps_cpp/message_type_support.h>

#include <memory>
#include <string>

#include "ros/types/message_form.hpp"

namespace connect_bridge::ros {

// The functions by which a middleware with Fast RTPS's type support reads and writes the messages
// of a bare_form(). The caller sets the names.
[[nodiscard]] message_type_support_callbacks_t bare_callbacks();

// A request or response of a type that is not installed. The bytes are forwarded unchanged, and
// their fields are not checked. Only plain CDR in this machine's byte order can be sent. The bytes
// of read_from() must live until reset(). `type`: the name of the message.
[[nodiscard]] std::unique_ptr<MessageForm> bare_form(std::string type);

}  // namespace connect_bridge::ros
