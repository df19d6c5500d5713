// Everything that differs between ROS distributions (Humble to Rolling) and middlewares, and
// nothing else.
#pragma once

#include <rcl/error_handling.h>
#include <rcl/graph.h>
#include <rcl/logging.h>
#include <rcl/logging_rosout.h>
#include <rcl/node.h>
#include <rmw/rmw.h>
#include <rmw/topic_endpoint_info.h>
#include <rosidl_runtime_c/message_type_support_struct.h>
#include <rosidl_runtime_c/service_type_support_struct.h>
#include <rosidl_typesupport_fastrtps_cpp/message_type_support.h>

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_set>

#include "core/base/ids.hpp"

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

// Whether endpoints can be made of types whose packages are not installed
// (ros/types/bare_types.hpp): these middlewares read and write messages by functions that type
// support brings with it, and the others by a type's fields.
inline bool takes_bare_types() {
  const std::string_view name = rmw_get_implementation_identifier();
  return name == "rmw_fastrtps_cpp" || name == "rmw_zenoh_cpp";
}

// rmw_zenoh_cpp joins the endpoints of a topic or service only where their hashes are the same.
inline bool joins_by_hash() {
  return std::string_view{rmw_get_implementation_identifier()} == "rmw_zenoh_cpp";
}

// Before Kilted rmw_fastrtps_cpp makes no endpoint without a type's fields, though it does nothing
// with them; since Kilted it tells them to others, so there it must not get wrong ones. No header
// tells which it is but this one, which got keys at that time.
template <class Callbacks = message_type_support_callbacks_t>
constexpr bool bare_types_need_introspection() {
  return !requires(Callbacks callbacks) {
    callbacks.key_callbacks;
  };
}

// Since Iron a service's type support has its requests' and its responses'.
template <class Service>
void set_parts(Service& service, const rosidl_message_type_support_t* requests,
               const rosidl_message_type_support_t* responses) {
  if constexpr (requires { service.request_typesupport; }) {
    service.request_typesupport = requests;
    service.response_typesupport = responses;
  }
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

// What the ids of all endpoints of a process begin with; all zero where ids do not tell.
inline Gid participant_of(const Gid& gid) {
  Gid participant;
  std::copy_n(gid.bytes.begin(), participant_prefix_size(), participant.bytes.begin());
  return participant;
}

// Who sent a request, as rmw tells it.
inline Gid caller_of(const rmw_request_id_t& request) {
  static_assert(sizeof(request.writer_guid) <= sizeof(Gid::bytes));
  Gid gid;
  std::copy(std::begin(request.writer_guid), std::end(request.writer_guid), gid.bytes.begin());
  return gid;
}

// How many clients a service has; nullopt: not told. rcl_count_clients() came after Iron, and no
// header tells of it, so the compiler is asked whether a call can be made.
template <class RclNode>
auto count_clients(const RclNode* node, const char* service, int)
    -> decltype(rcl_count_clients(node, service, nullptr), std::optional<std::size_t>{}) {
  std::size_t count = 0;
  if (rcl_count_clients(node, service, &count) != RCL_RET_OK) return std::nullopt;
  return count;
}
template <class RclNode>
std::optional<std::size_t> count_clients(const RclNode*, const char*, long) {
  return std::nullopt;
}

// Whether callers_in_graph() knows callers one by one.
inline bool tells_callers() {
  return participant_prefix_size() > 0;
}

// Whether the writers of responses in the graph tell all servers, and ids which of them are ours.
inline bool tells_servers() {
  return participant_prefix_size() > 0;
}

// Everyone in the graph who may have sent requests to this service (a full name), comparable with
// caller_of(); nullopt: this middleware does not tell, or failed. With rmw_fastrtps the callers are
// the readers of responses; the ids that others put into a request are not those of the graph, and
// there only "nobody at all" is known.
inline std::optional<std::unordered_set<Gid>> callers_in_graph(const rcl_node_t* node,
                                                               const std::string& service) {
  std::optional<std::unordered_set<Gid>> callers;
  if (!tells_callers()) {
    if (count_clients(node, service.c_str(), 0) == std::optional<std::size_t>{0}) callers.emplace();
  } else {
    const std::string topic = "rr" + service + "Reply";
    auto allocator = rcl_get_default_allocator();
    auto array = rcl_get_zero_initialized_topic_endpoint_info_array();
    if (rcl_get_subscriptions_info_by_topic(node, &allocator, topic.c_str(), true, &array) ==
        RCL_RET_OK) {
      callers.emplace();
      for (std::size_t i = 0; i < array.size; ++i) {
        callers->insert(gid_of(array.info_array[i].endpoint_gid));
      }
      if (rcl_topic_endpoint_info_array_fini(&array, &allocator) != RCL_RET_OK) callers.reset();
    }
  }
  if (!callers) rcl_reset_error();
  return callers;
}

}  // namespace connect_bridge::ros::distro
