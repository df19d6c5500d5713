#include "ros/service_fixture.hpp"

#include <rcl/error_handling.h>
#include <rcl/graph.h>
#include <rmw/rmw.h>
#include <rosidl_runtime_c/string_functions.h>
#include <rosidl_typesupport_introspection_c/identifier.h>
#include <rosidl_typesupport_introspection_c/message_introspection.h>

namespace connect_bridge::ros {
namespace {

constexpr std::size_t kCallMemoryMax = 1U << 30;

Bytes bytes_of_message(MessageForm& form) {
  rmw_serialized_message_t message = rmw_get_zero_initialized_serialized_message();
  auto allocator = rcl_get_default_allocator();
  EXPECT_EQ(RMW_RET_OK, rmw_serialized_message_init(&message, 0, &allocator));
  EXPECT_EQ(std::nullopt, form.write_to(message));
  Bytes bytes(message.buffer, message.buffer + message.buffer_length);
  EXPECT_EQ(RMW_RET_OK, rmw_serialized_message_fini(&message));
  form.reset();
  return bytes;
}

std::shared_ptr<ServiceType> type_of_name(TypeSupports& types, const std::string& name) {
  return std::get<0>(types.service(name, ""));
}

}  // namespace

void Cdr::number(std::uint64_t value, std::size_t size) {
  while ((bytes_.size() - 4) % size != 0) bytes_.push_back(0);
  for (std::size_t i = 0; i < size; ++i) {
    bytes_.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  }
}
Cdr& Cdr::u8(std::uint8_t value) {
  return number(value, 1), *this;
}
Cdr& Cdr::u32(std::uint32_t value) {
  return number(value, 4), *this;
}
Cdr& Cdr::u64(std::uint64_t value) {
  return number(value, 8), *this;
}
Cdr& Cdr::text(const std::string& value) {
  u32(static_cast<std::uint32_t>(value.size() + 1));
  bytes_.insert(bytes_.end(), value.begin(), value.end());
  bytes_.push_back(0);
  return *this;
}
Cdr& Cdr::wide(const std::u16string& value) {
  u32(static_cast<std::uint32_t>(value.size()));
  for (const char16_t c : value) u32(c);
  return *this;
}
Cdr& Cdr::zeros(std::size_t count) {
  bytes_.resize(bytes_.size() + count);
  return *this;
}

void overfill(MessageForm& reflect) {
  using Members = rosidl_typesupport_introspection_c__MessageMembers;
  static TypeSupports types;
  const auto type = std::get<0>(types.message(std::string{kTestPackage} + "/msg/Everything", ""));
  const auto* members = static_cast<const Members*>(type.introspection->data);
  for (std::uint32_t i = 0; i < members->member_count_; ++i) {
    const auto& member = members->members_[i];
    if (member.name_ != std::string{"short_text"}) continue;
    // `everything` is the first field of Reflect, so it begins where the message does.
    auto* text = static_cast<std::byte*>(reflect.message()) + member.offset_;
    EXPECT_TRUE(rosidl_runtime_c__String__assign(reinterpret_cast<rosidl_runtime_c__String*>(text),
                                                 "seventeen letters"));
    return;
  }
  ADD_FAILURE() << "no short_text";
}

Bytes set_bool(bool on) {
  return Cdr{}.u8(on).bytes();
}
Bytes set_bool_answer(bool success, const std::string& message) {
  return Cdr{}.u8(success).text(message).bytes();
}

RawServer::RawServer(TestNode& node, const std::string& service, const std::string& type,
                     std::size_t depth)
    : node_(node), type_(type_of_name(types_, type)) {
  rcl_service_options_t options = rcl_service_get_default_options();
  options.qos.depth = depth;
  EXPECT_EQ(RCL_RET_OK,
            rcl_service_init(&service_, node->handle(), type_->handle, service.c_str(), &options));
}

RawServer::~RawServer() {
  EXPECT_EQ(RCL_RET_OK, rcl_service_fini(&service_, node_->handle()));
}

std::optional<RawServer::Request> RawServer::take() {
  rmw_service_info_t info{};
  const auto result = rcl_take_request_with_info(&service_, &info, type_->request->message());
  if (result != RCL_RET_OK) return std::nullopt;
  return Request{info.request_id, bytes_of_message(*type_->request)};
}

bool RawServer::try_respond(const Request& request, const Bytes& response) {
  rmw_request_id_t id = request.first;
  EXPECT_EQ(std::nullopt, type_->response->read_from(response, kCallMemoryMax));
  const rcl_ret_t result = rcl_send_response(&service_, &id, type_->response->message());
  if (result == RCL_RET_OK) return true;
  rcl_reset_error();
  EXPECT_EQ(RCL_RET_TIMEOUT, result);
  return false;
}

void RawServer::respond_with(const Request& request, const Fill& fill) {
  rmw_request_id_t id = request.first;
  fill(*type_->response);
  EXPECT_EQ(RCL_RET_OK, rcl_send_response(&service_, &id, type_->response->message()));
}

RawClient::RawClient(TestNode& node, const std::string& service, const std::string& type,
                     rmw_qos_profile_t qos)
    : node_(node), type_(type_of_name(types_, type)) {
  rcl_client_options_t options = rcl_client_get_default_options();
  options.qos = qos;
  EXPECT_EQ(RCL_RET_OK,
            rcl_client_init(&client_, node->handle(), type_->handle, service.c_str(), &options));
}

RawClient::~RawClient() {
  EXPECT_EQ(RCL_RET_OK, rcl_client_fini(&client_, node_->handle()));
}

bool RawClient::ready() {
  bool ready = false;
  EXPECT_EQ(RCL_RET_OK, rcl_service_server_is_available(node_->handle(), &client_, &ready));
  return ready;
}

std::int64_t RawClient::send(const Bytes& request) {
  std::int64_t number = 0;
  EXPECT_EQ(std::nullopt, type_->request->read_from(request, kCallMemoryMax));
  EXPECT_EQ(RCL_RET_OK, rcl_send_request(&client_, type_->request->message(), &number));
  return number;
}

std::int64_t RawClient::send_with(const Fill& fill) {
  std::int64_t number = 0;
  fill(*type_->request);
  EXPECT_EQ(RCL_RET_OK, rcl_send_request(&client_, type_->request->message(), &number));
  return number;
}

std::optional<RawClient::Response> RawClient::take() {
  rmw_service_info_t info{};
  const auto result = rcl_take_response_with_info(&client_, &info, type_->response->message());
  if (result != RCL_RET_OK) return std::nullopt;
  return Response{info.request_id.sequence_number, bytes_of_message(*type_->response)};
}

}  // namespace connect_bridge::ros
