// The part of a run-time type support that holds the hash of its type.
#pragma once

#include <optional>
#include <string>

#include "ros/rcl/distro.hpp"

#if CONNECT_TYPE_HASHES
#include <rosidl_runtime_c/type_description/type_description__functions.h>
#include <rosidl_runtime_c/type_description/type_source__functions.h>
#endif

namespace connect_bridge::ros {

// The hash that a bridge shows for a type whose hash it does not know.
inline std::string nobodys_hash() {
  return "RIHS01_" + std::string(64, '0');
}

#if CONNECT_TYPE_HASHES

using TypeHash = rosidl_type_hash_t;

// Parses "RIHS01_..."; an empty text gives an unset hash. nullopt: not a ROS type hash.
inline std::optional<TypeHash> parse_type_hash(const std::string& text) {
  TypeHash hash = rosidl_get_zero_initialized_type_hash();
  if (text.empty()) return hash;
  if (rosidl_parse_type_hash_string(text.c_str(), &hash) == RCUTILS_RET_OK) return hash;
  rcutils_reset_error();
  return std::nullopt;
}

// An empty description: no name, no fields, no sources. rcl copies the description of a type and
// its sources when it creates an endpoint, so they must exist.
struct NoDescription {
  NoDescription() { rosidl_runtime_c__type_description__TypeDescription__init(&description); }
  ~NoDescription() { rosidl_runtime_c__type_description__TypeDescription__fini(&description); }
  NoDescription(const NoDescription&) = delete;
  NoDescription& operator=(const NoDescription&) = delete;

  rosidl_runtime_c__type_description__TypeDescription description{};
  rosidl_runtime_c__type_description__TypeSource__Sequence sources{};

  static const NoDescription& instance() {
    static const NoDescription none;
    return none;
  }
};

// `Support` is rosidl_message_type_support_t or rosidl_service_type_support_t.
template <class Support>
struct Hashed : Support {
  explicit Hashed(const TypeHash& the_hash) : Support{}, hash(the_hash) {
    this->get_type_hash_func = [](const Support* self) {
      return &static_cast<const Hashed*>(self)->hash;
    };
    this->get_type_description_func = [](const Support*) {
      return &NoDescription::instance().description;
    };
    this->get_type_description_sources_func = [](const Support*) {
      return &NoDescription::instance().sources;
    };
  }
  TypeHash hash;
};

#else

struct TypeHash {};

inline std::optional<TypeHash> parse_type_hash(const std::string&) {
  return TypeHash{};
}

template <class Support>
struct Hashed : Support {
  explicit Hashed(const TypeHash&) : Support{} {}
  TypeHash hash;
};

#endif

}  // namespace connect_bridge::ros
