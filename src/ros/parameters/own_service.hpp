// One service that is answered at once, with the C messages of a package we link.
#pragma once

#include <rcl/service.h>
#include <rmw/qos_profiles.h>

#include <functional>
#include <memory>
#include <string>

#include "ros/entities/ready_list.hpp"
#include "ros/node/node.hpp"

namespace connect_bridge::ros {

// The part that does not depend on the type. Thread: the loop's.
class ServiceEndpoint {
 public:
  // Throws RosError. `slot` is marked when requests wait; it stays the caller's.
  ServiceEndpoint(Node& node, const rosidl_service_type_support_t* type, const std::string& name,
                  const rmw_qos_profile_t& qos, ReadyList::Slot* slot);
  virtual ~ServiceEndpoint();
  ServiceEndpoint(const ServiceEndpoint&) = delete;
  ServiceEndpoint& operator=(const ServiceEndpoint&) = delete;

  // Answers one request; false if none waits.
  virtual bool serve() = 0;

 protected:
  bool take(void* request, rmw_service_info_t& info);
  void answer(rmw_service_info_t& info, void* response);

 private:
  Node& node_;
  const std::string name_;
  rcl_service_t service_ = rcl_get_zero_initialized_service();
};

// `Type` has Request, Response, their create and destroy functions, and type_support().
template <class Type>
class ServiceServer final : public ServiceEndpoint {
 public:
  using Handler =
      std::function<bool(const typename Type::Request&, typename Type::Response& response)>;

  ServiceServer(Node& node, const std::string& name, const rmw_qos_profile_t& qos,
                ReadyList::Slot* slot, Handler handler)
      : ServiceEndpoint(node, Type::type_support(), name, qos, slot),
        handler_(std::move(handler)) {}

  bool serve() override {
    const std::unique_ptr<typename Type::Request, decltype(Type::destroy_request)> request(
        Type::create_request(), Type::destroy_request);
    const std::unique_ptr<typename Type::Response, decltype(Type::destroy_response)> response(
        Type::create_response(), Type::destroy_response);
    if (!request || !response) return false;
    rmw_service_info_t info{};
    if (!take(request.get(), info)) return false;
    if (handler_(*request, *response)) answer(info, response.get());
    return true;
  }

 private:
  const Handler handler_;
};

}  // namespace connect_bridge::ros
