// Type support at run time: by the type's name, from the shared libraries of installed packages.
#pragma once

#include <rosidl_runtime_c/message_type_support_struct.h>
#include <rosidl_runtime_c/service_type_support_struct.h>

#include <chrono>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <variant>

#include "ros/rcl/rcl_result.hpp"
#include "ros/types/message_form.hpp"

namespace connect_bridge::ros {

// Lives as long as the TypeSupports that made it.
struct ServiceType {
  std::string name;                                       // "std_srvs/srv/SetBool"
  const rosidl_service_type_support_t* handle = nullptr;  // for rcl
  std::string hash;                                       // "RIHS01_...", or empty
  std::unique_ptr<MessageForm> request, response;
};

// A Refusal has the code "type_unknown" or "type_mismatch". Thread: the loop's. What it hands out
// lives as long as the process: libraries are never unloaded, because the middleware keeps
// references to type support.
class TypeSupports {
 public:
  using MessageType = std::variant<const rosidl_message_type_support_t*, Refusal>;
  using Service = std::variant<ServiceType*, Refusal>;

  // The type support of "std_msgs/msg/String". A `hash` that is not empty ("RIHS01_...") must be
  // the hash of the installed definition, where the distribution has hashes.
  MessageType message(const std::string& type, const std::string& hash);
  // The same of "std_srvs/srv/SetBool" or "<package>/action/<Action>_SendGoal".
  Service service(const std::string& type, const std::string& hash);

 private:
  MessageType load_message(const std::string& type);
  std::variant<std::unique_ptr<ServiceType>, Refusal> load_service(const std::string& type);
  // The result of a function of the package of `type`; `kind` is "message" or "service".
  std::variant<const void*, Refusal> load(const std::string& type, const std::string& kind);

  // The library of a package; null: not installed.
  void* library_of(const std::string& package);

  std::map<std::string, MessageType, std::less<>> messages_;
  std::map<std::string, std::unique_ptr<ServiceType>, std::less<>> services_;
  std::map<std::string, void*, std::less<>> libraries_;  // by package
  // Packages that were looked for in vain, and when they are looked for again. A peer may ask for
  // any, and each takes a search of the file system.
  std::map<std::string, std::chrono::steady_clock::time_point, std::less<>> missing_;
};

}  // namespace connect_bridge::ros
