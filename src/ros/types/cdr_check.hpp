// Checks serialized messages field by field, without deserializing them.
#pragma once

#include <rosidl_runtime_c/message_type_support_struct.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>

#include "core/base/bytes.hpp"

namespace connect_bridge::ros {

// Size of the header before the fields: the byte order, and unused options.
inline constexpr std::size_t kCdrHeaderSize = 4;

// Limits for the strings and sequences, and for the nested messages, in a message of a peer. A few
// kilobytes that decompress to 64 MiB can be millions of empty strings. These take almost no
// memory, but most of a second of the loop's time. Measured: a string or sequence takes about 100
// ns to check, read, send on and free, a nested message up to 80 ns. So the limits mean 20 ms and
// up to 80 ms. A million points pass, and 30,000 values of parameters.
inline constexpr std::size_t kBlocksMax = 200'000;
inline constexpr std::size_t kNestedMax = 1'000'000;

struct CdrLimits {
  std::size_t memory = std::numeric_limits<std::size_t>::max();  // bytes of strings and sequences
  std::size_t blocks = std::numeric_limits<std::size_t>::max();  // number of strings and sequences
  std::size_t nested = std::numeric_limits<std::size_t>::max();  // messages within it
};

// Limits for a request or a response, which this process deserializes.
inline CdrLimits call_limits(std::size_t memory) {
  return {memory, kBlocksMax, kNestedMax};
}

// Limits for a sample of a topic, which this process does not deserialize, but its subscribers do.
// A string takes some 15 ns to check, a nested message less. So the limits mean 15 ms and up to 100
// ms of the loop. `ros_tests --gtest_filter=CdrCheck.ATopicsSampleCostsLittle` measures this. The
// cost for subscribers depends on the sample's size.
inline CdrLimits sample_limits(std::size_t bytes) {
  return {(16U << 20U) + 8 * bytes, 1'000'000, 8'000'000};
}

// The introspection type support of a type; nullptr: it is not installed.
[[nodiscard]] const rosidl_message_type_support_t* introspection_of(
    const rosidl_message_type_support_t* type);

// True if the first field of a type (its introspection type support) is a std_msgs/msg/Header.
[[nodiscard]] bool begins_with_header(const rosidl_message_type_support_t& type);

// True if a type (its introspection type support) has a key field (`@key` in its IDL). Always false
// before Kilted, which does not show keys.
[[nodiscard]] bool has_keys(const rosidl_message_type_support_t& type);

// Checks whether bytes of a peer can be a message of a type, before memory is allocated for them.
// Follows the fields of `type` (its introspection type support) through the bytes: plain CDR after
// its 4-byte header, of either byte order.
//
// rmw_deserialize() allocates memory for as many elements as a sequence claims to have before it
// reads them, so a few hostile bytes would cost gigabytes. Here every length must be covered by
// existing bytes and respect the bounds of its field. Bytes after the last field are ignored, as in
// the middlewares.
//
// The time is proportional to the number of strings, nested messages and their fields. Returns
// the problem; nullopt: none.
[[nodiscard]] std::optional<std::string> check_cdr(ByteView bytes,
                                                   const rosidl_message_type_support_t& type,
                                                   const CdrLimits& limits);

// Clears the padding between the fields of a message that this process has serialized: middlewares
// leave old memory content there, which a peer must not read. Returns the end of the message,
// because middlewares also reserve more than they write; nullopt: `problem` states why the bytes do
// not fit the type. Middlewares do not enforce all bounds of strings, but a peer will.
[[nodiscard]] std::optional<std::size_t> clear_padding(std::span<std::uint8_t> bytes,
                                                       const rosidl_message_type_support_t& type,
                                                       std::string& problem);

}  // namespace connect_bridge::ros
