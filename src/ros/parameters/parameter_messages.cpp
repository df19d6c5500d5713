#include "ros/parameters/parameter_messages.hpp"

#include <rcl_interfaces/msg/floating_point_range.h>
#include <rcl_interfaces/msg/integer_range.h>
#include <rosidl_runtime_c/primitives_sequence_functions.h>
#include <rosidl_runtime_c/string_functions.h>

#include <algorithm>

namespace connect_bridge::ros {
namespace {

// Sequences of messages are zeroed, so their init must run exactly once.
template <class Sequence, class List, class Init>
bool copy_list(Sequence& to, const List& from, Init init) {
  if (!init(&to, from.size())) return false;
  std::copy(from.begin(), from.end(), to.data);
  return true;
}

template <class Value, class Sequence>
std::vector<Value> list_of(const Sequence& from) {
  return std::vector<Value>(from.data, from.data + from.size);
}

struct Filler {
  rcl_interfaces__msg__ParameterValue& to;

  bool operator()(bool value) const {
    to.bool_value = value;
    return true;
  }
  bool operator()(std::int64_t value) const {
    to.integer_value = value;
    return true;
  }
  bool operator()(double value) const {
    to.double_value = value;
    return true;
  }
  bool operator()(const std::string& value) const { return assign(to.string_value, value); }
  bool operator()(const std::vector<bool>& list) const {
    return copy_list(to.bool_array_value, list, rosidl_runtime_c__boolean__Sequence__init);
  }
  bool operator()(const std::vector<std::int64_t>& list) const {
    return copy_list(to.integer_array_value, list, rosidl_runtime_c__int64__Sequence__init);
  }
  bool operator()(const std::vector<double>& list) const {
    return copy_list(to.double_array_value, list, rosidl_runtime_c__double__Sequence__init);
  }
  bool operator()(const std::vector<std::string>& list) const {
    return assign(to.string_array_value, list);
  }
  bool operator()(const Bytes& list) const {
    return copy_list(to.byte_array_value, list, rosidl_runtime_c__octet__Sequence__init);
  }
};

}  // namespace

bool assign(rosidl_runtime_c__String& to, std::string_view text) {
  return rosidl_runtime_c__String__assignn(&to, text.data(), text.size());
}

bool assign(rosidl_runtime_c__String__Sequence& to, const std::vector<std::string>& texts) {
  if (!rosidl_runtime_c__String__Sequence__init(&to, texts.size())) return false;
  for (std::size_t i = 0; i < texts.size(); ++i) {
    if (!assign(to.data[i], texts[i])) return false;
  }
  return true;
}

std::string text_of(const rosidl_runtime_c__String& text) {
  return {text.data, text.size};
}

std::vector<std::string> texts_of(const rosidl_runtime_c__String__Sequence& texts) {
  std::vector<std::string> result;
  result.reserve(texts.size);
  for (std::size_t i = 0; i < texts.size; ++i) result.push_back(text_of(texts.data[i]));
  return result;
}

bool fill(rcl_interfaces__msg__ParameterValue& to, const std::optional<ParameterValue>& value) {
  if (!value) return true;
  to.type = static_cast<std::uint8_t>(type_of(*value));
  return std::visit(Filler{to}, *value);
}

bool fill(rcl_interfaces__msg__ParameterDescriptor& to, const ParameterDescriptor& entry) {
  to.type = static_cast<std::uint8_t>(entry.type);
  to.read_only = entry.read_only;
  if (entry.range && entry.type == ParameterType::kInteger) {
    if (!rcl_interfaces__msg__IntegerRange__Sequence__init(&to.integer_range, 1)) return false;
    to.integer_range.data[0].from_value = static_cast<std::int64_t>(entry.range->min);
    to.integer_range.data[0].to_value = static_cast<std::int64_t>(entry.range->max);
  }
  if (entry.range && entry.type == ParameterType::kDouble) {
    auto& ranges = to.floating_point_range;
    if (!rcl_interfaces__msg__FloatingPointRange__Sequence__init(&ranges, 1)) return false;
    ranges.data[0].from_value = entry.range->min;
    ranges.data[0].to_value = entry.range->max;
  }
  return assign(to.name, entry.name) && assign(to.description, entry.description) &&
         assign(to.additional_constraints, entry.constraints);
}

bool fill(rcl_interfaces__msg__Parameter__Sequence& to, const std::vector<Parameter>& parameters) {
  if (!rcl_interfaces__msg__Parameter__Sequence__init(&to, parameters.size())) return false;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    if (!assign(to.data[i].name, parameters[i].name)) return false;
    if (!fill(to.data[i].value, parameters[i].value)) return false;
  }
  return true;
}

Parameter parameter_of(const rcl_interfaces__msg__Parameter& message) {
  Parameter parameter{text_of(message.name), std::nullopt};
  const auto& from = message.value;
  switch (static_cast<ParameterType>(from.type)) {
    case ParameterType::kBool: parameter.value = from.bool_value; break;
    case ParameterType::kInteger: parameter.value = from.integer_value; break;
    case ParameterType::kDouble: parameter.value = from.double_value; break;
    case ParameterType::kString: parameter.value = text_of(from.string_value); break;
    case ParameterType::kBytes:
      parameter.value = list_of<std::uint8_t>(from.byte_array_value);
      break;
    case ParameterType::kBools: parameter.value = list_of<bool>(from.bool_array_value); break;
    case ParameterType::kIntegers:
      parameter.value = list_of<std::int64_t>(from.integer_array_value);
      break;
    case ParameterType::kDoubles: parameter.value = list_of<double>(from.double_array_value); break;
    case ParameterType::kStrings: parameter.value = texts_of(from.string_array_value); break;
    default: break;
  }
  return parameter;
}

}  // namespace connect_bridge::ros
