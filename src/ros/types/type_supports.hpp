// Type support at run time: by the type's name, from the shared libraries of installed packages.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <variant>

#include "ros/types/message_form.hpp"

namespace connect_bridge::ros {

// Why there is no type support; `code` as in wire Decline ("type_unknown", "type_mismatch").
struct TypeRefusal {
  std::string code;
  std::string reason;  // a sentence a person can act on
};

// Thread: the loop's. What it hands out lives as long as the process: libraries are never unloaded,
// because the middleware keeps references to type support.
class TypeSupports {
 public:
  using MessageType = std::variant<const rosidl_message_type_support_t*, TypeRefusal>;
  using Service = std::variant<ServiceType*, TypeRefusal>;

  // The type support of "std_msgs/msg/String". A `hash` that is not empty ("RIHS01_...") must be
  // the hash of the installed definition, where the distribution has hashes.
  MessageType message(const std::string& type, const std::string& hash);
  // The same of "std_srvs/srv/SetBool" or "<package>/action/<Action>_SendGoal".
  Service service(const std::string& type, const std::string& hash);

 private:
  MessageType load_message(const std::string& type);
  std::variant<std::unique_ptr<ServiceType>, TypeRefusal> load_service(const std::string& type);
  // The result of a function of the package of `type`; `kind` is "message" or "service".
  std::variant<const void*, TypeRefusal> load(const std::string& type, const std::string& kind);

  std::map<std::string, MessageType, std::less<>> messages_;
  std::map<std::string, std::unique_ptr<ServiceType>, std::less<>> services_;
  std::map<std::string, void*, std::less<>> libraries_;  // by package
};

}  // namespace connect_bridge::ros
