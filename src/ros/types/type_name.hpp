// Names of types: "<package>/<kind>/<name>".
#pragma once

#include <optional>
#include <string>

namespace connect_bridge::ros {

struct TypeName {
  std::string package, kind, name;  // "std_msgs", "msg", "String"

  // "std_msgs/msg/String"
  [[nodiscard]] std::string full() const { return package + "/" + kind + "/" + name; }
  // The type that a person must install: the action's own for types that ROS derives from an
  // action.
  [[nodiscard]] std::string to_install() const;
};

// Parses a type name: three identifiers, at most 255 bytes; nullopt: not a type name. The text may
// be a peer's choice, and becomes part of a file name and of a symbol name.
[[nodiscard]] std::optional<TypeName> parse_type_name(const std::string& type);

}  // namespace connect_bridge::ros
