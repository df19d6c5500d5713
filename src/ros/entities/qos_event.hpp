// One QoS event of a subscription. The event never happens if the middleware lacks it.
#pragma once

#include <rcl/event.h>

#include <optional>
#include <string>

#include "ros/entities/ready_list.hpp"

namespace connect_bridge::ros {

// Close the event before its subscription. Without a callback it can only be polled. Thread: the
// loop's.
class QosEvent {
 public:
  QosEvent() = default;
  ~QosEvent() { close(); }
  QosEvent(const QosEvent&) = delete;
  QosEvent& operator=(const QosEvent&) = delete;

  void open(const rcl_subscription_t* subscription, rcl_subscription_event_type_t type,
            rcl_event_callback_t callback, ReadyList::Slot* slot);
  void close();
  // Takes the event; `status` is rmw's structure for this type of event. False: nothing has
  // happened.
  bool take(void* status);
  // Takes an event of incompatible QoS: the policy that does not fit.
  std::optional<std::string> take_policy();

 private:
  rcl_event_t event_ = rcl_get_zero_initialized_event();
  bool open_ = false;
  bool listening_ = false;
};

}  // namespace connect_bridge::ros
