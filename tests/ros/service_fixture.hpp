// Plain rcl services and clients whose requests and responses are bytes, as the rest of the graph.
#pragma once

#include <rcl/client.h>
#include <rcl/service.h>
#include <rmw/qos_profiles.h>

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "ros/ros_fixture.hpp"

namespace connect_bridge::ros {

constexpr char kSetBool[] = "std_srvs/srv/SetBool";
constexpr char kTestPackage[] = "connect_bridge_test_interfaces";
constexpr char kMadeUp[] = "made_up/msg/Thing";  // is not installed

// CDR, little endian, built field by field.
class Cdr {
 public:
  Cdr& u8(std::uint8_t value);
  Cdr& u32(std::uint32_t value);
  Cdr& u64(std::uint64_t value);
  Cdr& text(const std::string& value);
  Cdr& wide(const std::u16string& value);
  Cdr& zeros(std::size_t count);  // without alignment
  [[nodiscard]] Bytes bytes() const { return bytes_; }

 private:
  void number(std::uint64_t value, std::size_t size);
  Bytes bytes_{0, 1, 0, 0};
};

using Fill = std::function<void(MessageForm& form)>;

// Gives Reflect's `everything.short_text` 17 characters where 16 are allowed: programs in C++ send
// that, and no middleware refuses it.
void overfill(MessageForm& reflect);

// std_srvs/srv/SetBool
Bytes set_bool(bool on);
Bytes set_bool_answer(bool success, const std::string& message);

class RawServer {
 public:
  using Request = std::pair<rmw_request_id_t, Bytes>;

  RawServer(TestNode& node, const std::string& service, const std::string& type = kSetBool,
            std::size_t depth = 10);
  ~RawServer();
  std::optional<Request> take();
  // Returns whether the middleware has reached the caller.
  bool try_respond(const Request& request, const Bytes& response);
  void respond(const Request& request, const Bytes& response) {
    EXPECT_TRUE(try_respond(request, response));
  }
  // As respond(), with a message that `fill` has changed, which may not be possible with bytes.
  void respond_with(const Request& request, const Fill& fill);

 private:
  TestNode& node_;
  TypeSupports types_;
  std::shared_ptr<ServiceType> type_;
  rcl_service_t service_ = rcl_get_zero_initialized_service();
};

class RawClient {
 public:
  using Response = std::pair<std::int64_t, Bytes>;

  RawClient(TestNode& node, const std::string& service, const std::string& type = kSetBool,
            rmw_qos_profile_t qos = rmw_qos_profile_services_default);
  ~RawClient();
  bool ready();
  std::int64_t send(const Bytes& request);   // the call's number
  std::int64_t send_with(const Fill& fill);  // as RawServer::respond_with()
  std::optional<Response> take();

 private:
  TestNode& node_;
  TypeSupports types_;
  std::shared_ptr<ServiceType> type_;
  rcl_client_t client_ = rcl_get_zero_initialized_client();
};

}  // namespace connect_bridge::ros
