// One service that this process answers itself, with the C messages of a package we link.
#pragma once

#include <rcl/service.h>
#include <rmw/qos_profiles.h>

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "ros/entities/entity.hpp"
#include "ros/node/node.hpp"

namespace connect_bridge::ros {

// The part that does not depend on the type. Thread: the loop's.
class OwnService : public Entity {
 public:
  // Throws RosError.
  OwnService(ReadyList& ready, Node& node, const rosidl_service_type_support_t* type,
             const std::string& name, const rmw_qos_profile_t& qos);
  ~OwnService() override;

 protected:
  // False: there is no request.
  bool take(void* request, rmw_service_info_t& info);
  void answer(rmw_service_info_t& info, void* response);

 private:
  Node& node_;
  const std::string name_;
  rcl_service_t service_ = rcl_get_zero_initialized_service();
};

// `Type` has Request, Response, their create and destroy functions, and type_support().
template <class Type>
class TypedService final : public OwnService {
 public:
  using Handler =
      std::function<bool(const typename Type::Request&, typename Type::Response& response)>;

  TypedService(ReadyList& ready, Node& node, const std::string& name, const rmw_qos_profile_t& qos,
               Handler handler)
      : OwnService(ready, node, Type::type_support(), name, qos), handler_(std::move(handler)) {}

  // Answers one request.
  std::optional<Input> step(Batch&) override {
    const std::unique_ptr<typename Type::Request, decltype(Type::destroy_request)> request(
        Type::create_request(), Type::destroy_request);
    const std::unique_ptr<typename Type::Response, decltype(Type::destroy_response)> response(
        Type::create_response(), Type::destroy_response);
    rmw_service_info_t info{};
    const bool more = expects_more();  // one that cannot be read looks like none
    if (!request || !response || !take(request.get(), info)) {
      if (!more) done(kReadyMessage);
      return std::nullopt;
    }
    if (handler_(*request, *response)) answer(info, response.get());
    return std::nullopt;
  }

 private:
  const Handler handler_;
};

}  // namespace connect_bridge::ros
