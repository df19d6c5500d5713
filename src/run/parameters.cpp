#include "run/parameters.hpp"

#include <optional>
#include <utility>

namespace connect_bridge {
namespace {

std::optional<ParameterValue> to_config(const ros::ParameterValue& value) {
  return std::visit(
      [](const auto& v) -> std::optional<ParameterValue> {
        if constexpr (std::is_same_v<std::decay_t<decltype(v)>, Bytes>) {
          return std::nullopt;
        } else {
          return ParameterValue{v};
        }
      },
      value);
}

ros::ParameterValue to_ros(const ParameterValue& value) {
  return std::visit([](const auto& v) { return ros::ParameterValue{v}; }, value);
}

ros::ParameterType to_ros(ValueType type) {
  switch (type) {
    case ValueType::kBool: return ros::ParameterType::kBool;
    case ValueType::kInteger: return ros::ParameterType::kInteger;
    case ValueType::kDouble: return ros::ParameterType::kDouble;
    case ValueType::kString: return ros::ParameterType::kString;
    case ValueType::kStrings: return ros::ParameterType::kStrings;
  }
  return ros::ParameterType::kNotSet;
}

Problem byte_array(const std::string& key) {
  return {key, "a byte array", "another type"};
}

}  // namespace

ParameterMap to_config(const ros::ParameterMap& parameters, std::vector<Problem>& problems) {
  ParameterMap result;
  for (const auto& [key, value] : parameters) {
    if (auto converted = to_config(value)) {
      result.emplace(key, std::move(*converted));
    } else {
      problems.push_back(byte_array(key));
    }
  }
  return result;
}

ParameterChanges to_config(const std::vector<ros::Parameter>& parameters,
                           std::vector<Problem>& problems) {
  ParameterChanges result;
  for (const auto& [key, value] : parameters) {
    if (!value) {
      result[key] = std::nullopt;
    } else if (auto converted = to_config(*value)) {
      result[key] = std::move(converted);
    } else {
      problems.push_back(byte_array(key));
    }
  }
  return result;
}

ros::ParameterEntry to_entry(const KeyDescriptor& descriptor) {
  ros::ParameterEntry entry;
  entry.name = descriptor.name;
  entry.type = to_ros(descriptor.type);
  entry.description = descriptor.description;
  entry.constraints = descriptor.constraints;
  entry.read_only = descriptor.read_only;
  if (descriptor.value) entry.value = to_ros(*descriptor.value);
  if (!descriptor.min || !descriptor.max) return entry;
  if (descriptor.type == ValueType::kInteger)
    entry.integer_range = ros::Range<std::int64_t>{static_cast<std::int64_t>(*descriptor.min),
                                                   static_cast<std::int64_t>(*descriptor.max), 0};
  if (descriptor.type == ValueType::kDouble)
    entry.double_range = ros::Range<double>{*descriptor.min, *descriptor.max, 0.0};
  return entry;
}

std::vector<ros::ParameterEntry> to_entries(const std::vector<KeyDescriptor>& descriptors) {
  std::vector<ros::ParameterEntry> entries;
  entries.reserve(descriptors.size());
  for (const auto& descriptor : descriptors) entries.push_back(to_entry(descriptor));
  return entries;
}

}  // namespace connect_bridge
