#include "ros/types/installed_description.hpp"

#include "core/types/type_description.hpp"
#include "ros/rcl/distro.hpp"

#if CONNECT_TYPE_HASHES
#include <rosidl_runtime_c/type_description/type_description__struct.h>
#endif

namespace connect_bridge::ros {

#if CONNECT_TYPE_HASHES

namespace {

std::string text_of(const rosidl_runtime_c__String& text) {
  return {text.data, text.size};
}

DescribedType read(const rosidl_runtime_c__type_description__IndividualTypeDescription& from) {
  DescribedType type{text_of(from.type_name), {}};
  for (std::size_t i = 0; i < from.fields.size; ++i) {
    const auto& field = from.fields.data[i];
    type.fields.push_back({text_of(field.name),
                           static_cast<FieldKind>(field.type.type_id % kFieldShapeStep),
                           static_cast<FieldShape>(field.type.type_id / kFieldShapeStep),
                           static_cast<std::uint32_t>(field.type.capacity),
                           static_cast<std::uint32_t>(field.type.string_capacity),
                           text_of(field.type.nested_type_name)});
  }
  return type;
}

template <class Support>
std::string text_of_type(const Support& type) {
  const auto* from =
      type.get_type_description_func ? type.get_type_description_func(&type) : nullptr;
  if (from == nullptr) return {};
  TypeDescription description{read(from->type_description), {}};
  const auto& nested = from->referenced_type_descriptions;
  for (std::size_t i = 0; i < nested.size; ++i) description.nested.push_back(read(nested.data[i]));
  return canonical_text(description);
}

}  // namespace

std::string description_of(const rosidl_message_type_support_t& type) {
  return text_of_type(type);
}
std::string description_of(const rosidl_service_type_support_t& type) {
  return text_of_type(type);
}

#else

std::string description_of(const rosidl_message_type_support_t&) {
  return {};
}
std::string description_of(const rosidl_service_type_support_t&) {
  return {};
}

#endif

}  // namespace connect_bridge::ros
