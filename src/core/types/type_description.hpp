// What a type is made of, from the text that its hash is the digest of.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"

namespace connect_bridge {

// Limits of a description beside kDescriptionBytesMax (docs/protocol.md, "Limits"). The largest
// type of ROS's own packages has 40 types and 300 fields, nested five deep.
inline constexpr std::size_t kDescribedTypesMax = 512;    // nested ones
inline constexpr std::size_t kDescribedFieldsMax = 4096;  // of all types together
inline constexpr std::size_t kDescribedDepthMax = 32;     // types within types

// The numbers of type_description_interfaces/msg/FieldType.
enum class FieldKind : std::uint8_t {
  kNested = 1,
  kInt8,
  kUint8,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kInt64,
  kUint64,
  kFloat,
  kDouble,
  kLongDouble,
  kChar,
  kWchar,
  kBoolean,
  kByte,
  kString,
  kWstring,
  kFixedString,
  kFixedWstring,
  kBoundedString,
  kBoundedWstring,
};
inline constexpr std::uint8_t kFieldShapeStep = 48;  // of the same numbers, from shape to shape
enum class FieldShape : std::uint8_t { kSingle, kArray, kBoundedSequence, kSequence };

struct DescribedField {
  std::string name;
  FieldKind kind = FieldKind::kNested;
  FieldShape shape = FieldShape::kSingle;
  std::uint32_t capacity = 0;         // elements of an array, at most of a bounded sequence, else 0
  std::uint32_t string_capacity = 0;  // characters of a fixed or bounded string, else 0
  std::string nested = {};            // the type of a nested message, else empty
  bool operator==(const DescribedField&) const = default;
};

struct DescribedType {
  std::string name;  // "geometry_msgs/msg/Pose"
  std::vector<DescribedField> fields;
  bool operator==(const DescribedType&) const = default;
};

// A type with all that it contains. Its hash (RIHS01 of REP-2016) is the SHA-256 of its canonical
// text, so a text that has the hash is what every side with that hash has: nobody can give out
// another one. The text has no default values and no comments.
struct TypeDescription {
  DescribedType type;
  std::vector<DescribedType> nested;  // ordered by name, all of them used

  // The nested type of this name; null: there is none.
  [[nodiscard]] const DescribedType* find(std::string_view name) const;
  bool operator==(const TypeDescription&) const = default;
};

// From hostile text. An error says what is wrong with it: it is no canonical text, beyond a limit
// above, has a kind of field that is not known, or types that are missing or contain themselves.
// Time and memory: proportional to the text.
[[nodiscard]] Result<TypeDescription> parse_description(std::string_view text);

// As rcl_type_description_to_hashable_json() writes it.
[[nodiscard]] std::string canonical_text(const TypeDescription& description);

// "RIHS01_..." of a canonical text.
[[nodiscard]] std::string type_hash_of(std::string_view text);

// What a field is, as in a .msg file: "float64[36]", "string<=10[<=5]", "geometry_msgs/Pose[]".
[[nodiscard]] std::string shown(const DescribedField& field);

}  // namespace connect_bridge
