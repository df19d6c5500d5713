#include "ros/rcl/take_buffer.hpp"

#include <rcutils/allocator.h>
#include <rmw/rmw.h>

#include <utility>

#include "ros/rcl/rcl_result.hpp"

namespace connect_bridge::ros {
namespace {

// Most samples fit; a larger one costs one realloc of an empty block.
constexpr std::size_t kFirstCapacity = 256;

}  // namespace

struct TakeBuffer::Owned {
  rmw_serialized_message_t message = rmw_get_zero_initialized_serialized_message();
  Owned() {
    auto allocator = rcutils_get_default_allocator();
    ignore_error(rmw_serialized_message_init(&message, kFirstCapacity, &allocator));
  }
  ~Owned() {
    if (message.buffer != nullptr) ignore_error(rmw_serialized_message_fini(&message));
  }
  Owned(const Owned&) = delete;
  Owned& operator=(const Owned&) = delete;
};

rmw_serialized_message_t* TakeBuffer::prepare() {
  if (!owned_) owned_ = std::make_shared<Owned>();
  owned_->message.buffer_length = 0;
  return &owned_->message;
}

Payload TakeBuffer::give_away() {
  const ByteView view{owned_->message.buffer, owned_->message.buffer_length};
  return Payload::wrap(std::move(owned_), view);
}

rmw_serialized_message_t as_serialized(ByteView bytes) {
  rmw_serialized_message_t message = rmw_get_zero_initialized_serialized_message();
  // The structure has no const member, but rmw only reads the bytes.
  message.buffer = const_cast<std::uint8_t*>(bytes.data());
  message.buffer_length = bytes.size();
  message.buffer_capacity = bytes.size();
  return message;
}

}  // namespace connect_bridge::ros
