#include "ros/types/described_fields.hpp"

#include <rosidl_runtime_c/string.h>
#include <rosidl_typesupport_introspection_c/field_types.h>
#include <rosidl_typesupport_introspection_c/identifier.h>

#include <algorithm>
#include <utility>

namespace connect_bridge::ros {
namespace {

// Arrays in arrays may be of any size in a description, but no message with them could arrive.
// Multiplied by the bytes of a message this is still a number of 64 bits.
constexpr std::size_t kMemoryMax = std::size_t{1} << 30U;

// The number in introspection type support, and the bytes in memory; 0: not known.
std::pair<std::uint8_t, std::size_t> kind_of(FieldKind kind) {
  switch (kind) {
    case FieldKind::kNested: return {rosidl_typesupport_introspection_c__ROS_TYPE_MESSAGE, 0};
    case FieldKind::kInt8: return {rosidl_typesupport_introspection_c__ROS_TYPE_INT8, 1};
    case FieldKind::kUint8: return {rosidl_typesupport_introspection_c__ROS_TYPE_UINT8, 1};
    case FieldKind::kInt16: return {rosidl_typesupport_introspection_c__ROS_TYPE_INT16, 2};
    case FieldKind::kUint16: return {rosidl_typesupport_introspection_c__ROS_TYPE_UINT16, 2};
    case FieldKind::kInt32: return {rosidl_typesupport_introspection_c__ROS_TYPE_INT32, 4};
    case FieldKind::kUint32: return {rosidl_typesupport_introspection_c__ROS_TYPE_UINT32, 4};
    case FieldKind::kInt64: return {rosidl_typesupport_introspection_c__ROS_TYPE_INT64, 8};
    case FieldKind::kUint64: return {rosidl_typesupport_introspection_c__ROS_TYPE_UINT64, 8};
    case FieldKind::kFloat: return {rosidl_typesupport_introspection_c__ROS_TYPE_FLOAT, 4};
    case FieldKind::kDouble: return {rosidl_typesupport_introspection_c__ROS_TYPE_DOUBLE, 8};
    case FieldKind::kChar: return {rosidl_typesupport_introspection_c__ROS_TYPE_CHAR, 1};
    case FieldKind::kBoolean: return {rosidl_typesupport_introspection_c__ROS_TYPE_BOOLEAN, 1};
    case FieldKind::kByte: return {rosidl_typesupport_introspection_c__ROS_TYPE_OCTET, 1};
    case FieldKind::kString:
    case FieldKind::kBoundedString:
      return {rosidl_typesupport_introspection_c__ROS_TYPE_STRING,
              sizeof(rosidl_runtime_c__String)};
    case FieldKind::kWstring:
    case FieldKind::kBoundedWstring:
      return {rosidl_typesupport_introspection_c__ROS_TYPE_WSTRING,
              sizeof(rosidl_runtime_c__String)};
    case FieldKind::kLongDouble:
    case FieldKind::kWchar:
    case FieldKind::kFixedString:
    case FieldKind::kFixedWstring: break;
  }
  return {0, 0};
}

}  // namespace

std::unique_ptr<DescribedFields> DescribedFields::make(TypeDescription description) {
  std::unique_ptr<DescribedFields> made(new DescribedFields(std::move(description)));
  return made->fill() ? std::move(made) : nullptr;
}

const rosidl_message_type_support_t* DescribedFields::introspection(std::string_view nested) const {
  const DescribedType* type = description_.find(nested);
  if (type == nullptr) return nullptr;
  return &parts_[1 + static_cast<std::size_t>(type - description_.nested.data())].support;
}

bool DescribedFields::fill() {
  parts_.emplace_back().type = &description_.type;
  for (const auto& nested : description_.nested) parts_.emplace_back().type = &nested;
  if (!std::all_of(parts_.begin(), parts_.end(), [this](Part& part) { return fill(part); }))
    return false;
  for (Part& part : parts_) part.members.size_of_ = measure(part);
  return true;
}

bool DescribedFields::fill(Part& part) {
  for (const auto& field : part.type->fields) {
    const std::uint8_t id = kind_of(field.kind).first;
    if (id == 0) return false;
    Member& member = part.fields.emplace_back();
    member.name_ = field.name.c_str();
    member.type_id_ = id;
    member.string_upper_bound_ = field.string_capacity;
    member.is_array_ = field.shape != FieldShape::kSingle;
    member.array_size_ = field.capacity;
    member.is_upper_bound_ = field.shape == FieldShape::kBoundedSequence;
    if (field.kind == FieldKind::kNested)
      member.members_ = &part_of(*description_.find(field.nested)).support;
  }
  part.members.message_namespace_ = "";
  part.members.message_name_ = part.type->name.c_str();
  part.members.member_count_ = static_cast<std::uint32_t>(part.fields.size());
  part.members.members_ = part.fields.data();
  part.support.typesupport_identifier = rosidl_typesupport_introspection_c__identifier;
  part.support.data = &part.members;
  return true;
}

DescribedFields::Part& DescribedFields::part_of(const DescribedType& type) {
  return parts_[1 + static_cast<std::size_t>(&type - description_.nested.data())];
}

// A description has no circles and is not deep (parse_description()).
std::size_t DescribedFields::measure(Part& part) {
  if (std::exchange(part.measured, true)) return part.members.size_of_;
  std::size_t sum = 0;
  for (const auto& field : part.type->fields) {
    std::size_t size = kind_of(field.kind).second;
    if (field.kind == FieldKind::kNested) size = measure(part_of(*description_.find(field.nested)));
    if (field.shape == FieldShape::kArray) size *= field.capacity;
    if (field.shape == FieldShape::kSequence || field.shape == FieldShape::kBoundedSequence)
      size = sizeof(rosidl_runtime_c__String);
    sum = std::min(sum + std::min(size, kMemoryMax), kMemoryMax);
  }
  return part.members.size_of_ = sum;
}

void DescribedUse::describe(const std::string& text) {
  if (std::exchange(is_described, true)) return;
  if (auto description = parse_description(text))
    fields = DescribedFields::make(std::move(description).value());
}

}  // namespace connect_bridge::ros
