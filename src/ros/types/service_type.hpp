// A service type that is known at run time.
#pragma once

#include <rosidl_runtime_c/service_type_support_struct.h>

#include <memory>
#include <string>

#include "ros/types/message_form.hpp"

namespace connect_bridge::ros {

// Thread: the loop's.
struct ServiceType {
  std::string name;                                       // "std_srvs/srv/SetBool"
  const rosidl_service_type_support_t* handle = nullptr;  // for rcl
  std::string hash;                                       // "RIHS01_..."; empty: not known
  bool is_installed = false;
  // Hashes of the request and response types; also empty if the type is not installed.
  std::string request_hash, response_hash;
  std::unique_ptr<MessageForm> request, response;
};

}  // namespace connect_bridge::ros
