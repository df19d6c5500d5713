// Everything that differs between ROS distributions (Humble to Rolling) and middlewares, and
// nothing else.
#pragma once

#include <rcl/logging.h>
#include <rcl/logging_rosout.h>
#include <rcl/node.h>
#include <rcl/publisher.h>
#include <rmw/error_handling.h>
#include <rmw/rmw.h>
#include <rmw/topic_endpoint_info.h>
#include <rosidl_runtime_c/message_type_support_struct.h>

#include <algorithm>
#include <string>
#include <string_view>

#include "core/base/ids.hpp"
#include "ros/own_endpoints.hpp"

#if __has_include(<rosidl_runtime_c/type_hash.h>)
#define CONNECT_TYPE_HASHES 1  // Iron and later
#include <rosidl_runtime_c/type_hash.h>
#else
#define CONNECT_TYPE_HASHES 0
#endif

namespace connect_bridge::ros::distro {

#if CONNECT_TYPE_HASHES
// "RIHS01_..."; empty where there is none.
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

inline std::string type_hash_of(const rmw_topic_endpoint_info_t& info) {
  return text_of(info.topic_type_hash);
}
#else
inline std::string type_hash_of(const rosidl_message_type_support_t&) {
  return {};
}
inline std::string type_hash_of(const rmw_topic_endpoint_info_t&) {
  return {};
}
#endif

// RMW_GID_STORAGE_SIZE is 24 on Humble and 16 later.
inline Gid gid_of(const std::uint8_t (&bytes)[RMW_GID_STORAGE_SIZE]) {
  static_assert(RMW_GID_STORAGE_SIZE <= sizeof(Gid::bytes));
  Gid gid;
  std::copy(std::begin(bytes), std::end(bytes), gid.bytes.begin());
  return gid;
}

// Since Jazzy the client library makes the node's /rosout publisher; before, rcl_node_init does,
// and a second one would be warned about.
inline rcl_ret_t init_rosout(rcl_node_t* node) {
#if CONNECT_TYPE_HASHES
  if (rcl_logging_rosout_enabled()) return rcl_logging_rosout_init_publisher_for_node(node);
#else
  (void)node;
#endif
  return RCL_RET_OK;
}

inline rcl_ret_t fini_rosout(rcl_node_t* node) {
#if CONNECT_TYPE_HASHES
  if (rcl_logging_rosout_enabled()) return rcl_logging_rosout_fini_publisher_for_node(node);
#else
  (void)node;
#endif
  return RCL_RET_OK;
}

// rmw_cyclonedds_cpp puts a local handle where the others put the publisher's id of the graph
// (ros2/rmw_cyclonedds#377).
inline bool samples_tell_origin() {
  return std::string_view{rmw_get_implementation_identifier()} != "rmw_cyclonedds_cpp";
}

// rmw_fastrtps can deadlock between a lost sample and whoever sets or takes an event, once a
// callback for lost samples is set (fixed by ros2/rmw_fastrtps#890). There the count is asked for
// instead.
inline bool lost_callback_is_safe() {
  return !std::string_view{rmw_get_implementation_identifier()}.starts_with("rmw_fastrtps");
}

// The ids of DDS endpoints begin with the 12 bytes of their participant, and a context has one
// participant. So one id of ours tells all others, those of endpoints that are gone included.
// 0: ids of this middleware do not tell.
inline std::size_t participant_prefix_size() {
  const std::string_view name = rmw_get_implementation_identifier();
  return name.starts_with("rmw_fastrtps") ? 12 : 0;
}

// The graph's id of our publisher, where the middleware tells it.
inline void add_own(OwnEndpoints& own, const rcl_publisher_t* publisher) {
  const rmw_publisher_t* handle = rcl_publisher_get_rmw_handle(publisher);
  rmw_gid_t gid{};
  if (handle != nullptr && rmw_get_gid_for_publisher(handle, &gid) == RMW_RET_OK) {
    own.add(gid_of(gid.data));
  } else {
    rmw_reset_error();
  }
}

}  // namespace connect_bridge::ros::distro
