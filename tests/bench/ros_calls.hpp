// A service and its client on bare rcl: what a call costs, and how many there are in a second.
// The type is rcl_interfaces/srv/GetParameterTypes, which every distribution has: the request
// carries a string, the response bytes, of any size.
#pragma once

#include <rcl/graph.h>
#include <rcl_interfaces/srv/get_parameter_types.h>
#include <rosidl_runtime_c/primitives_sequence_functions.h>
#include <rosidl_runtime_c/string_functions.h>

#include <map>

#include "ros_node.hpp"

namespace bench {

inline constexpr char kService[] = "/bench/service";

inline const rosidl_service_type_support_t* service_type() {
  return ROSIDL_GET_SRV_TYPE_SUPPORT(rcl_interfaces, srv, GetParameterTypes);
}

// Deep enough for everything that is under way.
inline rmw_qos_profile_t service_qos() {
  auto qos = rmw_qos_profile_services_default;
  qos.depth = 1000;
  return qos;
}

class CallWaiter {
 public:
  CallWaiter(Node& node, const rcl_service_t* service, const rcl_client_t* client)
      : service_(service), client_(client) {
    require(rcl_wait_set_init(&set_, 0, 0, 0, client == nullptr ? 0 : 1, service == nullptr ? 0 : 1,
                              0, node.context(), rcl_get_default_allocator()),
            "wait set");
  }
  ~CallWaiter() { require(rcl_wait_set_fini(&set_), "wait set"); }
  CallWaiter(const CallWaiter&) = delete;
  CallWaiter& operator=(const CallWaiter&) = delete;
  bool wait_until(std::int64_t when_ns) {
    require(rcl_wait_set_clear(&set_), "clear");
    if (service_ != nullptr) require(rcl_wait_set_add_service(&set_, service_, nullptr), "add");
    if (client_ != nullptr) require(rcl_wait_set_add_client(&set_, client_, nullptr), "add");
    if (rcl_wait(&set_, std::max<std::int64_t>(when_ns - now_ns(), 0)) == RCL_RET_OK) return true;
    rcl_reset_error();
    return false;
  }

 private:
  const rcl_service_t* service_;
  const rcl_client_t* client_;
  rcl_wait_set_t set_ = rcl_get_zero_initialized_wait_set();
};

// Answers at once with as many bytes as the request has.
inline void run_serve(Node& node, Commands& commands) {
  auto service = rcl_get_zero_initialized_service();
  auto options = rcl_service_get_default_options();
  options.qos = service_qos();
  require(rcl_service_init(&service, node.handle(), service_type(), kService, &options), "service");
  rcl_interfaces__srv__GetParameterTypes_Request request;
  rcl_interfaces__srv__GetParameterTypes_Response response;
  if (!rcl_interfaces__srv__GetParameterTypes_Request__init(&request) ||
      !rcl_interfaces__srv__GetParameterTypes_Response__init(&response)) {
    std::abort();
  }
  {
    CallWaiter waiter(node, &service, nullptr);
    answer("{\"ready\":true}");
    while (!commands.ended()) {
      if (!waiter.wait_until(now_ns() + 500'000'000)) {
        (void)commands.next(0);
        continue;
      }
      rmw_request_id_t id;
      while (rcl_take_request(&service, &id, &request) == RCL_RET_OK) {
        const std::size_t size = request.names.size == 0 ? 0 : request.names.data[0].size;
        if (response.types.size != size) {
          rosidl_runtime_c__uint8__Sequence__fini(&response.types);
          if (!rosidl_runtime_c__uint8__Sequence__init(&response.types, size)) std::abort();
        }
        if (rcl_send_response(&service, &id, &response) != RCL_RET_OK) rcl_reset_error();
      }
      rcl_reset_error();
    }
  }
  rcl_interfaces__srv__GetParameterTypes_Request__fini(&request);
  rcl_interfaces__srv__GetParameterTypes_Response__fini(&response);
  require(rcl_service_fini(&service, node.handle()), "service");
}

class Calls {
 public:
  explicit Calls(Node& node) : node_(node) {
    auto options = rcl_client_get_default_options();
    options.qos = service_qos();
    require(rcl_client_init(&client_, node.handle(), service_type(), kService, &options), "client");
    if (!rcl_interfaces__srv__GetParameterTypes_Request__init(&request_) ||
        !rcl_interfaces__srv__GetParameterTypes_Response__init(&response_) ||
        !rosidl_runtime_c__String__Sequence__init(&request_.names, 1)) {
      std::abort();
    }
    waiter_ = std::make_unique<CallWaiter>(node, nullptr, &client_);
  }
  ~Calls() {
    waiter_.reset();
    rcl_interfaces__srv__GetParameterTypes_Request__fini(&request_);
    rcl_interfaces__srv__GetParameterTypes_Response__fini(&response_);
    require(rcl_client_fini(&client_, node_.handle()), "client");
  }
  Calls(const Calls&) = delete;
  Calls& operator=(const Calls&) = delete;

  // Until a call is answered; false: no answer.
  bool warm_up() {
    set_size(12);
    for (const auto end = now_ns() + 40'000'000'000; now_ns() < end;) {
      bool there = false;
      require(rcl_service_server_is_available(node_.handle(), &client_, &there), "available");
      if (!there) {
        sleep_until(now_ns() + 20'000'000);
        continue;
      }
      send();
      take_until(now_ns() + 1'000'000'000);
      if (!times_.empty()) return true;
    }
    return false;
  }

  // Keeps `window` calls under way until `samples` are answered, or for `seconds`.
  std::string measure(const Options& options) {
    set_size(options.count("size", 12));
    const auto window = options.count("window", 1);
    const auto samples = options.count("samples", 0);
    const auto gap = static_cast<std::int64_t>(options.number("gap", 0) * 1e9);
    open_.clear();
    times_.clear();
    const auto begin = now_ns();
    const auto end = begin + static_cast<std::int64_t>(options.number("seconds", 60) * 1e9);
    std::size_t sent = 0, lost = 0;
    auto last = begin;
    while (now_ns() < end && (samples == 0 || times_.size() + lost < samples)) {
      while (open_.size() < window && (samples == 0 || sent < samples)) {
        send();
        ++sent;
      }
      if (take_until(now_ns() + 2'000'000'000)) {
        last = now_ns();
        if (gap > 0) sleep_until(last + gap);
      } else {
        lost += open_.size();
        open_.clear();
      }
    }
    const double seconds = static_cast<double>(last - begin) / 1e9;
    const auto answered = times_.size();
    while (!open_.empty() && take_until(now_ns() + 2'000'000'000)) {
    }
    lost += open_.size();
    char text[128];
    std::snprintf(text, sizeof text,
                  "{\"lost\":%zu,\"wrong\":%zu,\"per_second\":%.2f,\"ms\":", lost, wrong_,
                  static_cast<double>(answered) / seconds);
    return text + (samples > 0 ? json_array(times_) : "[]") + "}";
  }

 private:
  void set_size(std::size_t size) {
    const std::string text(size, 'x');
    if (!rosidl_runtime_c__String__assign(&request_.names.data[0], text.c_str())) std::abort();
    size_ = size;
    wrong_ = 0;
  }
  void send() {
    std::int64_t number = 0;
    const auto now = now_ns();
    require(rcl_send_request(&client_, &request_, &number), "send request");
    open_[number] = now;
  }
  bool take_until(std::int64_t until) {
    bool took = false;
    while (!took && now_ns() < until) {
      if (!waiter_->wait_until(until)) continue;
      rmw_request_id_t id;
      while (rcl_take_response(&client_, &id, &response_) == RCL_RET_OK) {
        const auto it = open_.find(id.sequence_number);
        if (it == open_.end()) continue;
        times_.push_back(static_cast<double>(now_ns() - it->second) / 1e6);
        if (response_.types.size != size_) ++wrong_;
        open_.erase(it);
        took = true;
      }
      rcl_reset_error();
    }
    return took;
  }

  Node& node_;
  rcl_client_t client_ = rcl_get_zero_initialized_client();
  rcl_interfaces__srv__GetParameterTypes_Request request_{};
  rcl_interfaces__srv__GetParameterTypes_Response response_{};
  std::unique_ptr<CallWaiter> waiter_;
  std::map<std::int64_t, std::int64_t> open_;  // sequence number -> sent at
  std::vector<double> times_;
  std::size_t size_ = 0, wrong_ = 0;
};

inline void run_call(Node& node, Commands& commands) {
  Calls calls(node);
  answer(calls.warm_up() ? "{\"ready\":true}" : "{\"error\":\"no answer\"}");
  while (!commands.ended()) {
    if (const auto command = commands.next(1000)) answer(calls.measure(*command));
  }
}

}  // namespace bench
