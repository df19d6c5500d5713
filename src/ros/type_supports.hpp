// Type support at run time: by the type's name, from the shared libraries of installed packages.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <variant>

struct rosidl_message_type_support_t;

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

  // The type support of "std_msgs/msg/String". A `hash` that is not empty ("RIHS01_...") must be
  // the hash of the installed definition, where the distribution has hashes.
  MessageType message(const std::string& type, const std::string& hash);

 private:
  MessageType load_message(const std::string& type);

  std::map<std::string, MessageType, std::less<>> messages_;
  std::map<std::string, void*, std::less<>> libraries_;  // by package
};

}  // namespace connect_bridge::ros
