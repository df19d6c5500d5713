// One publisher that publishes serialized samples.
#pragma once

#include <rcl/publisher.h>

#include <optional>
#include <string>

#include "core/ports/ports.hpp"
#include "ros/entities/ready_list.hpp"
#include "ros/node/node.hpp"
#include "ros/node/proxy_nodes.hpp"
#include "ros/rcl/qos_event.hpp"

namespace connect_bridge::ros {

// Thread: the loop's.
class Mirror {
 public:
  // `owner` is the node that has the publisher. `slot` is marked when there is something to do; it
  // stays the caller's.
  Mirror(Node& node, ProxyNodes::Handle owner, std::string topic, ReadyList::Slot* slot);
  ~Mirror();
  Mirror(const Mirror&) = delete;
  Mirror& operator=(const Mirror&) = delete;

  // An error text, or nothing.
  std::optional<std::string> open(const rosidl_message_type_support_t* type,
                                  const rmw_qos_profile_t& qos);
  // An error text, or nothing. The bytes are not copied here.
  std::optional<std::string> publish(ByteView bytes);
  std::optional<std::string> take_incompatible_policy();

  [[nodiscard]] const std::string& topic() const { return topic_; }
  [[nodiscard]] ReadyList::Slot* slot() const { return slot_; }

 private:
  Node& node_;
  const ProxyNodes::Handle owner_;
  const std::string topic_;
  ReadyList::Slot* const slot_;
  rcl_publisher_t publisher_ = rcl_get_zero_initialized_publisher();
  bool open_ = false;
  QosEvent incompatible_;
};

}  // namespace connect_bridge::ros
