#include "ros/types/bare_form.hpp"

#include <fastcdr/Cdr.h>
#include <fastcdr/config.h>
#include <rmw/rmw.h>

#include <algorithm>
#include <bit>
#include <utility>

#include "ros/rcl/rcl_result.hpp"
#include "ros/types/cdr_check.hpp"

namespace connect_bridge::ros {
namespace {

using eprosima::fastcdr::Cdr;

constexpr std::uint8_t kOrder = std::endian::native == std::endian::little ? 1 : 0;
// Bytes of the first request, before the size of a message predicts the size of the next.
constexpr std::size_t kFirstBytes = 64;
constexpr std::size_t kExpectedMax = 64U << 10U;

// The object behind message() of a form.
struct BareMessage {
  BareMessage() : taken(rmw_get_zero_initialized_serialized_message()) {
    auto allocator = rcutils_get_default_allocator();
    ignore_error(rmw_serialized_message_init(&taken, kCdrHeaderSize + kFirstBytes, &allocator));
  }
  ~BareMessage() { ignore_error(rmw_serialized_message_fini(&taken)); }
  BareMessage(const BareMessage&) = delete;
  BareMessage& operator=(const BareMessage&) = delete;

  ByteView body;                   // to be sent, without the header
  rmw_serialized_message_t taken;  // with the header
  std::size_t expected = kFirstBytes;
};

bool take_exactly(Cdr& cdr, std::uint8_t* into, std::size_t size) {
  try {
#if FASTCDR_VERSION_MAJOR >= 2
    cdr.deserialize_array(into, size);
#else
    cdr.deserializeArray(into, size);
#endif
    return true;
  } catch (...) {  // fewer bytes are left, and none was taken
    return false;
  }
}

bool is_plain(const Cdr& cdr) {
#if FASTCDR_VERSION_MAJOR >= 2
  return cdr.get_encoding_flag() == eprosima::fastcdr::EncodingAlgorithmFlag::PLAIN_CDR;
#else
  (void)cdr;
  return true;
#endif
}

bool make_room(rmw_serialized_message_t& bytes, std::size_t capacity) {
  return ignore_error(rmw_serialized_message_resize(&bytes, capacity));
}

// No function returns the number of bytes left. Reading too many throws an exception, which takes
// one or two microseconds: one exception if a message has the size of the last one, otherwise a
// few.
bool take_all(Cdr& cdr, BareMessage& message) {
  rmw_serialized_message_t& taken = message.taken;
  std::size_t size = kCdrHeaderSize;
  bool has_memory = true;
  const auto take = [&](std::size_t step) {
    if (taken.buffer_capacity < size + step)
      has_memory = has_memory && make_room(taken, size + step);
    if (!has_memory || !take_exactly(cdr, taken.buffer + size, step)) return false;
    size += step;
    return true;
  };
  // First as many bytes as the last message had, then steps that double, until less than a step is
  // left. Then each smaller power of two is tried once.
  std::size_t step = std::clamp<std::size_t>(message.expected, 1, kExpectedMax);
  if (take(step))
    for (step = 1; take(step);) step *= 2;
  for (step = std::bit_ceil(step) / 2; step > 0; step /= 2) take(step);
  if (!has_memory) return false;
  message.expected = size - kCdrHeaderSize;
  taken.buffer_length = size;
  // Queues count the size of the bytes, so the buffer must not be much larger.
  return taken.buffer_capacity <= 2 * size + kFirstBytes || make_room(taken, size);
}

bool deserialize(Cdr& cdr, void* untyped) {
  auto& message = *static_cast<BareMessage*>(untyped);
  message.taken.buffer_length = 0;
  if (!is_plain(cdr) || !take_all(cdr, message)) return false;
  const bool little = cdr.endianness() == Cdr::LITTLE_ENDIANNESS;
  std::fill_n(message.taken.buffer, kCdrHeaderSize, std::uint8_t{0});
  message.taken.buffer[1] = little ? 1 : 0;
  return true;
}

bool serialize(const void* untyped, Cdr& cdr) {
  const ByteView body = static_cast<const BareMessage*>(untyped)->body;
  try {
#if FASTCDR_VERSION_MAJOR >= 2
    cdr.serialize_array(body.data(), body.size());
#else
    cdr.serializeArray(body.data(), body.size());
#endif
    return true;
  } catch (...) {
    return false;
  }
}

class BareForm final : public MessageForm {
 public:
  explicit BareForm(std::string type) : type_(std::move(type)) {}

  void* message() override { return &message_; }

  // Swaps its buffer with the buffer of `bytes`: no copy.
  std::optional<std::string> write_to(rmw_serialized_message_t& bytes) override {
    if (message_.taken.buffer_length < kCdrHeaderSize) return "no bytes of a " + type_;
    std::swap(bytes, message_.taken);
    return std::nullopt;
  }

  std::optional<std::string> read_from(ByteView bytes, std::size_t) override {
    if (bytes.size() < kCdrHeaderSize || bytes[0] != 0 || bytes[1] > 1)
      return "not a " + type_ + ": the bytes are not plain CDR";
    if (bytes[1] != kOrder)
      return "a " + type_ + " of the other byte order can be sent only where the type is installed";
    message_.body = bytes.subspan(kCdrHeaderSize);
    return std::nullopt;
  }

  void reset() override {
    message_.body = {};
    message_.taken.buffer_length = 0;
  }

 private:
  const std::string type_;
  BareMessage message_;
};

}  // namespace

message_type_support_callbacks_t bare_callbacks() {
  message_type_support_callbacks_t callbacks{};
  callbacks.cdr_serialize = &serialize;
  callbacks.cdr_deserialize = &deserialize;
  callbacks.get_serialized_size = [](const void* untyped) {
    return static_cast<std::uint32_t>(static_cast<const BareMessage*>(untyped)->body.size());
  };
  callbacks.max_serialized_size = [](char& bounds) -> std::size_t {
    bounds = ROSIDL_TYPESUPPORT_FASTRTPS_UNBOUNDED_TYPE;
    return 0;
  };
  return callbacks;
}

std::unique_ptr<MessageForm> bare_form(std::string type) {
  return std::make_unique<BareForm>(std::move(type));
}

}  // namespace connect_bridge::ros
