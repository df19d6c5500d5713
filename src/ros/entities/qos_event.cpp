#include "ros/entities/qos_event.hpp"

#include <rmw/events_statuses/events_statuses.h>
#include <rmw/qos_string_conversions.h>

#include "ros/rcl/rcl_result.hpp"

namespace connect_bridge::ros {

void QosEvent::open(const rcl_subscription_t* subscription, rcl_subscription_event_type_t type,
                    rcl_event_callback_t callback, ReadyList::Slot* slot) {
  open_ = ignore_error(rcl_subscription_event_init(&event_, subscription, type));
  listening_ = open_ && callback != nullptr;
  if (listening_) ignore_error(rcl_event_set_callback(&event_, callback, slot));
}

void QosEvent::close() {
  if (!open_) return;
  open_ = false;
  if (listening_) ignore_error(rcl_event_set_callback(&event_, nullptr, nullptr));
  ignore_error(rcl_event_fini(&event_));
  event_ = rcl_get_zero_initialized_event();
}

bool QosEvent::take(void* status) {
  return open_ && ignore_error(rcl_take_event(&event_, status));
}

std::optional<std::string> QosEvent::take_policy() {
  rmw_qos_incompatible_event_status_t status{};  // for publishers and subscriptions alike
  if (!take(&status)) return std::nullopt;
  const char* const policy = rmw_qos_policy_kind_to_str(status.last_policy_kind);
  return policy ? policy : "unknown";
}

}  // namespace connect_bridge::ros
