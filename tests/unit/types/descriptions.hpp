// Descriptions of types for tests.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/types/type_description.hpp"

namespace connect_bridge {

// rosidl's own text and hash of std_msgs/msg/Empty.
inline const std::string kEmptyText =
    R"({"type_description": {"type_name": "std_msgs/msg/Empty", "fields": [{"name": )"
    R"("structure_needs_at_least_one_member", "type": {"type_id": 3, "capacity": 0, )"
    R"("string_capacity": 0, "nested_type_name": ""}}]}, "referenced_type_descriptions": []})";
inline const std::string kEmptyHash =
    "RIHS01_20b625256f32d5dbc0d04fee44f43c41e51c70d3502f84b4a08e7a9c26a96312";

inline DescribedField field(std::string name, FieldKind kind,
                            FieldShape shape = FieldShape::kSingle, std::uint32_t capacity = 0) {
  return {std::move(name), kind, shape, capacity};
}
inline DescribedField nested_field(std::string name, std::string type,
                                   FieldShape shape = FieldShape::kSingle) {
  return {std::move(name), FieldKind::kNested, shape, 0, 0, std::move(type)};
}
inline TypeDescription description(std::string name, std::vector<DescribedField> fields,
                                   std::vector<DescribedType> nested = {}) {
  return {{std::move(name), std::move(fields)}, std::move(nested)};
}

}  // namespace connect_bridge
