#include "ros/topics/mirror.hpp"

#include <rmw/events_statuses/events_statuses.h>
#include <rmw/rmw.h>

#include "ros/node/own_endpoints.hpp"
#include "ros/rcl/distro.hpp"
#include "ros/rcl/qos.hpp"
#include "ros/rcl/rcl_result.hpp"

namespace connect_bridge::ros {

Mirror::Mirror(Node& node, ProxyNodes::Handle owner, std::string topic, ReadyList::Slot* slot)
    : node_(node), owner_(std::move(owner)), topic_(std::move(topic)), slot_(slot) {}

Mirror::~Mirror() {
  if (!open_) return;
  incompatible_.close();
  ignore_error(rcl_publisher_fini(&publisher_, owner_.get()));
}

std::optional<std::string> Mirror::open(const rosidl_message_type_support_t* type,
                                        const rmw_qos_profile_t& qos) {
  rcl_publisher_options_t options = rcl_publisher_get_default_options();
  options.qos = qos;
  const rcl_ret_t result =
      rcl_publisher_init(&publisher_, owner_.get(), type, topic_.c_str(), &options);
  if (result != RCL_RET_OK) return error_text("cannot publish on " + topic_, result);
  open_ = true;
  distro::add_own(node_.own(), &publisher_);
  incompatible_.open(&publisher_, RCL_PUBLISHER_OFFERED_INCOMPATIBLE_QOS,
                     &ReadyList::on_incompatible, slot_);
  return std::nullopt;
}

std::optional<std::string> Mirror::publish(ByteView bytes) {
  rcl_serialized_message_t message = rmw_get_zero_initialized_serialized_message();
  // rmw only reads it, but the structure has no const.
  message.buffer = const_cast<std::uint8_t*>(bytes.data());
  message.buffer_length = bytes.size();
  message.buffer_capacity = bytes.size();
  const rcl_ret_t result = rcl_publish_serialized_message(&publisher_, &message, nullptr);
  if (result == RCL_RET_OK) return std::nullopt;
  return error_text("cannot publish on " + topic_, result);
}

std::optional<std::string> Mirror::take_incompatible_policy() {
  rmw_offered_qos_incompatible_event_status_t status{};
  if (!incompatible_.take(&status)) return std::nullopt;
  return policy_name(status.last_policy_kind);
}

}  // namespace connect_bridge::ros
