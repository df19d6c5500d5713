// One ROS node with publishers, subscriptions and a wait set, on rcl and with serialized messages
// only, so that the benchmark's own cost is small. Types are loaded by name as the bridge loads
// them; the type is std_msgs/msg/UInt8MultiArray where none is named.
#pragma once

#include <dlfcn.h>
#include <rcl/error_handling.h>
#include <rcl/rcl.h>
#include <rosidl_runtime_c/message_type_support_struct.h>

#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "timing.hpp"

namespace bench {

inline void require(rcl_ret_t result, const char* what) {
  if (result == RCL_RET_OK) return;
  std::fprintf(stderr, "%s: %s\n", what, rcl_get_error_string().str);
  std::exit(1);
}

struct MessageType {
  std::string package = "std_msgs";
  std::string name = "UInt8MultiArray";
};

inline const rosidl_message_type_support_t* type_support(const MessageType& type) {
  const auto file = "lib" + type.package + "__rosidl_typesupport_c.so";
  const auto symbol = "rosidl_typesupport_c__get_message_type_support_handle__" + type.package +
                      "__msg__" + type.name;
  void* library = dlopen(file.c_str(), RTLD_NOW);
  using Get = const rosidl_message_type_support_t* (*)();
  Get get = nullptr;
  if (library != nullptr) get = reinterpret_cast<Get>(dlsym(library, symbol.c_str()));
  if (get == nullptr) {
    std::fprintf(stderr, "%s is not installed: %s\n", type.package.c_str(), dlerror());
    std::exit(1);
  }
  return get();
}

// CDR before the bytes: encapsulation, no dimensions, data_offset, number of bytes.
inline constexpr std::size_t kHeadBytes = 16;
inline constexpr std::size_t kBodyBytesMin = 12;
// The number of a message that only finds out whether there is an echo.
inline constexpr std::uint32_t kWarmUp = 0xffffffff;

class Message {
 public:
  explicit Message(std::size_t body_bytes)
      : message_(rmw_get_zero_initialized_serialized_message()) {
    body_bytes = std::max(body_bytes, kBodyBytesMin);
    allocator_ = rcl_get_default_allocator();
    if (rmw_serialized_message_init(&message_, kHeadBytes + body_bytes, &allocator_) !=
        RMW_RET_OK) {
      std::abort();
    }
    const std::uint8_t head[12] = {0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
    const auto size = static_cast<std::uint32_t>(body_bytes);
    std::memcpy(message_.buffer, head, sizeof head);
    std::memcpy(message_.buffer + sizeof head, &size, sizeof size);
    fill(message_.buffer + kHeadBytes, body_bytes);
    message_.buffer_length = kHeadBytes + body_bytes;
  }
  ~Message() {
    if (rmw_serialized_message_fini(&message_) != RMW_RET_OK) rcutils_reset_error();
  }
  Message(const Message&) = delete;
  Message& operator=(const Message&) = delete;

  // Three numbers at the start of the body carry what a mode needs (sequence, run, ...).
  void put(std::uint32_t a, std::uint32_t b = 0, std::uint32_t c = 0) {
    const std::uint32_t words[3] = {a, b, c};
    std::memcpy(message_.buffer + kHeadBytes, words, sizeof words);
  }
  [[nodiscard]] std::uint32_t word(std::size_t i) const {
    std::uint32_t w = 0;
    std::memcpy(&w, message_.buffer + kHeadBytes + 4 * i, sizeof w);
    return w;
  }
  [[nodiscard]] std::size_t body_bytes() const { return message_.buffer_length - kHeadBytes; }
  rcl_serialized_message_t* get() { return &message_; }

 private:
  rcl_serialized_message_t message_;
  rcl_allocator_t allocator_{};
};

// Owns the context and the node; entities are ended before it, so that no shared memory stays
// behind.
class Node {
 public:
  explicit Node(const std::string& name, std::size_t depth, bool reliable = true,
                bool latched = false)
      : depth_(depth), reliable_(reliable), latched_(latched) {
    auto options = rcl_get_zero_initialized_init_options();
    require(rcl_init_options_init(&options, rcl_get_default_allocator()), "init options");
    require(rcl_init(0, nullptr, &options, &context_), "init");
    require(rcl_init_options_fini(&options), "init options");
    auto node_options = rcl_node_get_default_options();
    node_options.enable_rosout = false;
    const auto unique = name + "_" + std::to_string(getpid());
    require(rcl_node_init(&node_, unique.c_str(), "", &context_, &node_options), "node");
  }
  ~Node() {
    require(rcl_node_fini(&node_), "node");
    require(rcl_shutdown(&context_), "shutdown");
    require(rcl_context_fini(&context_), "context");
  }
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;
  [[nodiscard]] rmw_qos_profile_t qos() const {
    auto q = rmw_qos_profile_default;
    q.depth = depth_;
    if (latched_) q.durability = RMW_QOS_POLICY_DURABILITY_TRANSIENT_LOCAL;
    if (!reliable_) q.reliability = RMW_QOS_POLICY_RELIABILITY_BEST_EFFORT;
    return q;
  }
  rcl_context_t* context() { return &context_; }
  rcl_node_t* handle() { return &node_; }

 private:
  std::size_t depth_;
  bool reliable_;
  bool latched_;
  rcl_context_t context_ = rcl_get_zero_initialized_context();
  rcl_node_t node_ = rcl_get_zero_initialized_node();
};

class Publisher {
 public:
  Publisher(Node& node, const std::string& topic, const MessageType& type = {}) : node_(node) {
    auto options = rcl_publisher_get_default_options();
    options.qos = node.qos();
    require(
        rcl_publisher_init(&publisher_, node.handle(), type_support(type), topic.c_str(), &options),
        "publisher");
  }
  ~Publisher() { require(rcl_publisher_fini(&publisher_, node_.handle()), "publisher"); }
  Publisher(const Publisher&) = delete;
  Publisher& operator=(const Publisher&) = delete;
  void send(Message& message) { send(message.get()); }
  void send(const rcl_serialized_message_t* message) {
    if (rcl_publish_serialized_message(&publisher_, message, nullptr) == RCL_RET_OK) return;
    ++failed_;
    rcl_reset_error();
  }
  [[nodiscard]] std::size_t peers() const {
    std::size_t n = 0;
    if (rcl_publisher_get_subscription_count(&publisher_, &n) != RCL_RET_OK) rcl_reset_error();
    return n;
  }
  [[nodiscard]] std::size_t failed() const { return failed_; }

 private:
  Node& node_;
  rcl_publisher_t publisher_ = rcl_get_zero_initialized_publisher();
  std::size_t failed_ = 0;
};

class Subscription {
 public:
  Subscription(Node& node, const std::string& topic, const MessageType& type = {}) : node_(node) {
    auto options = rcl_subscription_get_default_options();
    options.qos = node.qos();
    require(rcl_subscription_init(&subscription_, node.handle(), type_support(type), topic.c_str(),
                                  &options),
            "subscription");
  }
  ~Subscription() {
    require(rcl_subscription_fini(&subscription_, node_.handle()), "subscription");
  }
  Subscription(const Subscription&) = delete;
  Subscription& operator=(const Subscription&) = delete;
  // False: nothing to take. After a large sample was lost in part, rmw_fastrtps has returned OK
  // with 0 bytes.
  bool take(Message& message) {
    rmw_message_info_t info;
    if (rcl_take_serialized_message(&subscription_, message.get(), &info, nullptr) != RCL_RET_OK) {
      rcl_reset_error();
      return false;
    }
    return message.get()->buffer_length >= kHeadBytes + kBodyBytesMin;
  }
  rcl_subscription_t* handle() { return &subscription_; }

 private:
  Node& node_;
  rcl_subscription_t subscription_ = rcl_get_zero_initialized_subscription();
};

class WaitSet {
 public:
  WaitSet(Node& node, std::vector<Subscription*> subscriptions)
      : subscriptions_(std::move(subscriptions)) {
    require(rcl_wait_set_init(&set_, subscriptions_.size(), 0, 0, 0, 0, 0, node.context(),
                              rcl_get_default_allocator()),
            "wait set");
  }
  ~WaitSet() { require(rcl_wait_set_fini(&set_), "wait set"); }
  WaitSet(const WaitSet&) = delete;
  WaitSet& operator=(const WaitSet&) = delete;
  // Waits once, at most until the time given; true: something may be there to take.
  bool wait_until(std::int64_t when_ns) {
    require(rcl_wait_set_clear(&set_), "clear");
    for (auto* s : subscriptions_) {
      require(rcl_wait_set_add_subscription(&set_, s->handle(), nullptr), "add");
    }
    if (rcl_wait(&set_, std::max<std::int64_t>(when_ns - now_ns(), 0)) == RCL_RET_OK) return true;
    rcl_reset_error();
    return false;
  }

 private:
  std::vector<Subscription*> subscriptions_;
  rcl_wait_set_t set_ = rcl_get_zero_initialized_wait_set();
};

}  // namespace bench
