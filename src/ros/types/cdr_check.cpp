#include "ros/types/cdr_check.hpp"

#include <rosidl_runtime_c/string.h>
#include <rosidl_runtime_c/u16string.h>
#include <rosidl_typesupport_introspection_c/field_types.h>
#include <rosidl_typesupport_introspection_c/identifier.h>
#include <rosidl_typesupport_introspection_c/message_introspection.h>

#include <algorithm>

#include "ros/rcl/rcl_result.hpp"

namespace connect_bridge::ros {
namespace {

using Members = rosidl_typesupport_introspection_c__MessageMembers;
using Member = rosidl_typesupport_introspection_c__MessageMember;

// Limit for a text that names the innermost fields, whose names may be a peer's choice.
constexpr std::size_t kProblemBytes = 200;
// All middlewares write a character of a wstring as 32 bits.
constexpr std::size_t kWideBytes = 4;
// The overhead of an allocation in bytes.
constexpr std::size_t kBlockBytes = 16;

const Members& members_of(const rosidl_message_type_support_t& type) {
  return *static_cast<const Members*>(type.data);
}

// The size of a primitive in bytes, which is also its alignment up to kAlignmentMax; 0: not a
// primitive.
std::size_t primitive_size(std::uint8_t type) {
  switch (type) {
    case rosidl_typesupport_introspection_c__ROS_TYPE_BOOLEAN:
    case rosidl_typesupport_introspection_c__ROS_TYPE_CHAR:
    case rosidl_typesupport_introspection_c__ROS_TYPE_OCTET:
    case rosidl_typesupport_introspection_c__ROS_TYPE_UINT8:
    case rosidl_typesupport_introspection_c__ROS_TYPE_INT8: return 1;
    case rosidl_typesupport_introspection_c__ROS_TYPE_UINT16:
    case rosidl_typesupport_introspection_c__ROS_TYPE_INT16: return 2;
    case rosidl_typesupport_introspection_c__ROS_TYPE_FLOAT:
    case rosidl_typesupport_introspection_c__ROS_TYPE_UINT32:
    case rosidl_typesupport_introspection_c__ROS_TYPE_INT32: return 4;
    case rosidl_typesupport_introspection_c__ROS_TYPE_DOUBLE:
    case rosidl_typesupport_introspection_c__ROS_TYPE_UINT64:
    case rosidl_typesupport_introspection_c__ROS_TYPE_INT64: return 8;
    case rosidl_typesupport_introspection_c__ROS_TYPE_LONG_DOUBLE: return 16;
    default: return 0;
  }
}

// CDR 1 has no larger alignment.
constexpr std::size_t kAlignmentMax = 8;

class Walk {
 public:
  Walk(ByteView body, bool little, const CdrLimits& limits)
      : body_(body), little_(little), limits_(limits), room_(limits) {}

  // Each function returns false at the first error, and sets `problem`.
  bool message(const Members& type) {
    for (std::uint32_t i = 0; i < type.member_count_; ++i) {
      if (!member(type.members_[i])) {
        if (problem.empty()) problem = "the bytes end too early";
        if (problem.size() < kProblemBytes)
          problem += std::string{" in "} + type.message_name_ + "." + type.members_[i].name_;
        return false;
      }
    }
    return true;
  }

  [[nodiscard]] std::size_t place() const { return place_; }

  std::string problem;
  std::uint8_t* clear = nullptr;  // the body, if its padding is to become zeros

 private:
  bool member(const Member& field) {
    if (!field.is_array_) return elements(field, 1);
    const bool fixed = field.array_size_ > 0 && !field.is_upper_bound_;
    if (fixed) return elements(field, field.array_size_);
    std::uint32_t count = 0;
    if (!length(count)) return false;
    if (field.is_upper_bound_ && count > field.array_size_) {
      problem = "more elements than allowed";
      return false;
    }
    // Every element takes at least one byte, so a larger count cannot be true.
    if (count > left()) return false;
    return block(count * memory_of(field)) && elements(field, count);
  }

  bool elements(const Member& field, std::size_t count) {
    if (const std::size_t size = primitive_size(field.type_id_)) {
      if (count == 0) return true;
      if (!align(std::min(size, kAlignmentMax)) || count > left() / size) return false;
      if (field.type_id_ == rosidl_typesupport_introspection_c__ROS_TYPE_LONG_DOUBLE)
        clear_unused(count);
      return skip(count * size);
    }
    for (std::size_t i = 0; i < count; ++i) {
      if (!element(field)) return false;
    }
    return true;
  }

  bool element(const Member& field) {
    switch (field.type_id_) {
      case rosidl_typesupport_introspection_c__ROS_TYPE_MESSAGE:
        return nest() && message(members_of(*field.members_));
      case rosidl_typesupport_introspection_c__ROS_TYPE_STRING: {
        std::uint32_t size = 0;
        if (!length(size)) return false;
        // The last byte is a zero that does not count.
        const std::size_t characters = size > 0 ? size - 1 : 0;
        return bounded(characters, field) && size <= left() && block(size) && skip(size);
      }
      case rosidl_typesupport_introspection_c__ROS_TYPE_WSTRING: {
        std::uint32_t count = 0;
        if (!length(count)) return false;
        return bounded(count, field) && count <= left() / kWideBytes && block(2 * count) &&
               skip(count * kWideBytes);
      }
      default: problem = "a kind of field that is not known"; return false;
    }
  }

  bool bounded(std::size_t characters, const Member& field) {
    if (field.string_upper_bound_ == 0 || characters <= field.string_upper_bound_) return true;
    problem = "more characters than allowed";
    return false;
  }

  static std::uint64_t memory_of(const Member& field) {
    switch (field.type_id_) {
      case rosidl_typesupport_introspection_c__ROS_TYPE_MESSAGE:
        return members_of(*field.members_).size_of_;
      case rosidl_typesupport_introspection_c__ROS_TYPE_STRING:
        return sizeof(rosidl_runtime_c__String);
      case rosidl_typesupport_introspection_c__ROS_TYPE_WSTRING:
        return sizeof(rosidl_runtime_c__U16String);
      default: return primitive_size(field.type_id_);
    }
  }

  bool length(std::uint32_t& value) {
    if (!align(4) || left() < 4) return false;
    const std::uint8_t* at = body_.data() + place_;
    value = 0;
    for (unsigned i = 0; i < 4; ++i) value |= std::uint32_t{at[little_ ? i : 3 - i]} << (8 * i);
    return skip(4);
  }

  bool align(std::size_t size) {
    const std::size_t padding = (size - place_ % size) % size;
    if (padding > left()) return false;
    if (clear != nullptr) std::fill_n(clear + place_, padding, std::uint8_t{0});
    return skip(padding);
  }

  // An x86 processor uses ten of the sixteen bytes of a long double.
  void clear_unused([[maybe_unused]] std::size_t count) {
#if defined(__x86_64__)
    for (std::size_t i = 0; clear != nullptr && i < count; ++i)
      std::fill_n(clear + place_ + 16 * i + 10, 6, std::uint8_t{0});
#endif
  }

  bool skip(std::size_t count) {
    if (count > left()) return false;
    place_ += count;
    return true;
  }

  // Counts a string or a sequence and its memory.
  bool block(std::uint64_t bytes) {
    if (room_.blocks == 0) {
      problem = "more strings and sequences than allowed (" + std::to_string(limits_.blocks) + ")";
      return false;
    }
    if (bytes + kBlockBytes > room_.memory) {
      problem = "more memory than allowed";
      return false;
    }
    --room_.blocks;
    room_.memory -= bytes + kBlockBytes;
    return true;
  }

  bool nest() {
    if (room_.nested == 0) {
      problem = "more messages within it than allowed (" + std::to_string(limits_.nested) + ")";
      return false;
    }
    --room_.nested;
    return true;
  }

  [[nodiscard]] std::size_t left() const {
    return body_.size() - place_;
  }

  const ByteView body_;
  const bool little_;
  const CdrLimits limits_;
  CdrLimits room_;  // remaining limits
  std::size_t place_ = 0;
};

}  // namespace

const rosidl_message_type_support_t* introspection_of(const rosidl_message_type_support_t* type) {
  const auto* found =
      get_message_typesupport_handle(type, rosidl_typesupport_introspection_c__identifier);
  if (found == nullptr) ignore_error(RCL_RET_ERROR);
  return found;
}

// A template, because only newer distributions have the field.
template <class Type>
bool any_key_of(const Type& members) {
  if constexpr (requires { members.has_any_key_member_; }) return members.has_any_key_member_;
  return false;
}

bool has_keys(const rosidl_message_type_support_t& type) {
  return any_key_of(members_of(type));
}

bool begins_with_header(const rosidl_message_type_support_t& type) {
  const Members& members = members_of(type);
  if (members.member_count_ == 0) return false;
  const Member& first = members.members_[0];
  if (first.is_array_ || first.type_id_ != rosidl_typesupport_introspection_c__ROS_TYPE_MESSAGE ||
      !first.members_)
    return false;
  const Members& inner = members_of(*first.members_);
  return std::string_view(inner.message_namespace_) == "std_msgs__msg" &&
         std::string_view(inner.message_name_) == "Header";
}

std::optional<std::string> check_cdr(ByteView bytes, const rosidl_message_type_support_t& type,
                                     const CdrLimits& limits) {
  // Other encapsulations exist (parameter lists, XCDR2); no ROS middleware writes them.
  if (bytes.size() < kCdrHeaderSize || bytes[0] != 0 || bytes[1] > 1) {
    return "the bytes are not plain CDR";
  }
  Walk walk(bytes.subspan(kCdrHeaderSize), bytes[1] == 1, limits);
  if (walk.message(members_of(type))) return std::nullopt;
  return walk.problem;
}

std::optional<std::size_t> clear_padding(std::span<std::uint8_t> bytes,
                                         const rosidl_message_type_support_t& type,
                                         std::string& problem) {
  if (bytes.size() < kCdrHeaderSize) {
    problem = "the bytes are not plain CDR";
    return std::nullopt;
  }
  Walk walk(bytes.subspan(kCdrHeaderSize), bytes[1] == 1, {});
  walk.clear = bytes.data() + kCdrHeaderSize;
  if (!walk.message(members_of(type))) {
    problem = walk.problem;
    return std::nullopt;
  }
  return kCdrHeaderSize + walk.place();
}

}  // namespace connect_bridge::ros
