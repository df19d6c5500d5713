#include "ros/parameters/own_service.hpp"

#include "ros/rcl/rcl_result.hpp"

namespace connect_bridge::ros {

OwnService::OwnService(ReadyList& ready, Node& node, const rosidl_service_type_support_t* type,
                       const std::string& name, const rmw_qos_profile_t& qos)
    : Entity(ready, kReadyMessage), node_(node), name_(name) {
  rcl_service_options_t options = rcl_service_get_default_options();
  options.qos = qos;
  require_ok(rcl_service_init(&service_, node.handle(), type, name.c_str(), &options),
             "cannot serve " + name);
  const rcl_ret_t result =
      rcl_service_set_on_new_request_callback(&service_, &ReadyList::on_counted, slot());
  if (result != RCL_RET_OK) {
    const auto text = error_text("cannot serve " + name, result);
    ignore_error(rcl_service_fini(&service_, node.handle()));
    throw RosError(text);
  }
  ReadyList::mark(slot(), kReadyMessage);
}

OwnService::~OwnService() {
  // The callback stays, as in ServiceMirror.
  ignore_error(rcl_service_fini(&service_, node_.handle()));
}

bool OwnService::take(void* request, rmw_service_info_t& info) {
  const rcl_ret_t result = rcl_take_request_with_info(&service_, &info, request);
  if (result != RCL_RET_OK && result != RCL_RET_SERVICE_TAKE_FAILED) {
    node_.log(LogLevel::kWarn, error_text("cannot take a request of " + name_, result));
    return false;
  }
  return ignore_error(result);
}

void OwnService::answer(rmw_service_info_t& info, void* response) {
  const rcl_ret_t result = rcl_send_response(&service_, &info.request_id, response);
  // The client may have left before the answer was sent.
  if (result != RCL_RET_OK) {
    node_.log(LogLevel::kDebug, error_text("cannot answer a request of " + name_, result));
  }
}

}  // namespace connect_bridge::ros
