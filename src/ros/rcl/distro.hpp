// All differences between ROS distributions (Humble to Rolling), and nothing else.
#pragma once

#include <rcl/error_handling.h>
#include <rcl/graph.h>
#include <rmw/topic_endpoint_info.h>
#include <rmw/types.h>
#include <rosidl_runtime_c/message_type_support_struct.h>
#include <rosidl_runtime_c/service_type_support_struct.h>
#include <rosidl_typesupport_fastrtps_cpp/message_type_support.h>

#include <algorithm>
#include <optional>
#include <string>

#include "core/base/ids.hpp"

#if __has_include(<rosidl_runtime_c/type_hash.h>)
#define CONNECT_TYPE_HASHES 1  // Iron and later
#include <rosidl_runtime_c/type_hash.h>
#else
#define CONNECT_TYPE_HASHES 0
#endif

namespace connect_bridge::ros::distro {

inline constexpr bool kTypeHashes = CONNECT_TYPE_HASHES != 0;

#if CONNECT_TYPE_HASHES
// The hash as "RIHS01_..."; empty if there is none.
inline std::string text_of(const rosidl_type_hash_t& hash) {
  if (hash.version == 0) return {};
  char* text = nullptr;
  auto allocator = rcutils_get_default_allocator();
  if (rosidl_stringify_type_hash(&hash, allocator, &text) != RCUTILS_RET_OK) {
    rcutils_reset_error();
    return {};
  }
  std::string result = text;
  allocator.deallocate(text, allocator.state);
  return result;
}

inline std::string type_hash_of(const rosidl_message_type_support_t& type) {
  const auto* hash = type.get_type_hash_func ? type.get_type_hash_func(&type) : nullptr;
  return hash ? text_of(*hash) : std::string{};
}

inline std::string type_hash_of(const rosidl_service_type_support_t& type) {
  const auto* hash = type.get_type_hash_func ? type.get_type_hash_func(&type) : nullptr;
  return hash ? text_of(*hash) : std::string{};
}

inline std::string type_hash_of(const rmw_topic_endpoint_info_t& info) {
  return text_of(info.topic_type_hash);
}
#else
inline std::string type_hash_of(const rosidl_message_type_support_t&) {
  return {};
}
inline std::string type_hash_of(const rosidl_service_type_support_t&) {
  return {};
}
inline std::string type_hash_of(const rmw_topic_endpoint_info_t&) {
  return {};
}
#endif

// RMW_GID_STORAGE_SIZE is 24 on Humble and 16 later.
template <std::size_t kSize>
Gid gid_of(const std::uint8_t (&bytes)[kSize]) {
  static_assert(kSize <= sizeof(Gid::bytes));
  Gid gid;
  std::copy(std::begin(bytes), std::end(bytes), gid.bytes.begin());
  return gid;
}

// rmw_fastrtps_cpp before Kilted creates no endpoint without a type's fields, although it does not
// use them. Since Kilted it sends them to others, so it must not get wrong ones. Only this header
// shows the version: it got keys at that time.
template <class Callbacks = message_type_support_callbacks_t>
constexpr bool bare_types_need_introspection() {
  return !requires(Callbacks callbacks) {
    callbacks.key_callbacks;
  };
}

// Since Iron a service's type support contains the type supports of requests and responses.
template <class Service>
void set_parts(Service& service, const rosidl_message_type_support_t* requests,
               const rosidl_message_type_support_t* responses) {
  if constexpr (requires { service.request_typesupport; }) {
    service.request_typesupport = requests;
    service.response_typesupport = responses;
  }
}

// Number of clients, and of servers, of a service; nullopt: not known. rcl_count_clients() and
// rcl_count_services() came after Iron, and no version macro shows it, so templates test whether
// they can be called.
template <class RclNode>
std::optional<std::size_t> count_clients(const RclNode* node, const char* service) {
  std::size_t count = 0;
  if constexpr (requires { rcl_count_clients(node, service, &count); })
    if (rcl_count_clients(node, service, &count) == RCL_RET_OK) return count;
  return std::nullopt;
}
template <class RclNode>
std::optional<std::size_t> count_servers(const RclNode* node, const char* service) {
  std::size_t count = 0;
  if constexpr (requires { rcl_count_services(node, service, &count); })
    if (rcl_count_services(node, service, &count) == RCL_RET_OK) return count;
  return std::nullopt;
}

}  // namespace connect_bridge::ros::distro
