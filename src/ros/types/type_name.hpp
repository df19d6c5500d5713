// Names of types: "<package>/<kind>/<name>".
#pragma once

#include <optional>
#include <string>

namespace connect_bridge::ros {

struct TypeName {
  std::string package, kind, name;  // "std_msgs", "msg", "String"

  // "std_msgs/msg/String"
  [[nodiscard]] std::string full() const { return package + "/" + kind + "/" + name; }
  // The type that a person must install: for the types that ROS derives from an action, the
  // action's own.
  [[nodiscard]] std::string to_install() const;
};

// A peer may have chosen the text, and it becomes part of a file name and of a symbol name: three
// identifiers, 255 bytes at most. nullopt: it is not a type name.
[[nodiscard]] std::optional<TypeName> parse_type_name(const std::string& type);

}  // namespace connect_bridge::ros
