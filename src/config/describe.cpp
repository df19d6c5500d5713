#include "config/describe.hpp"

#include "config/key_search.hpp"

namespace connect_bridge {
namespace {

ParameterDescriptor descriptor(const KeySpec& spec, std::string_view key) {
  ParameterDescriptor made;
  made.name = key;
  made.type = spec.type;
  made.description = spec.help;
  if (!spec.unit.empty()) made.description += " Unit: " + spec.unit + ".";
  if (!spec.changeable) made.description += " A change needs a restart.";
  made.constraints = expected_of(spec);
  made.range = spec.range;
  made.read_only = !spec.changeable;
  made.value = spec.fallback;
  return made;
}

}  // namespace

std::optional<ParameterDescriptor> describe_parameter(std::string_view key, Role role) {
  const KeySpec* spec = find_key(key);
  if (spec == nullptr || spec->secret || !is_used_by(*spec, role)) return std::nullopt;
  return descriptor(*spec, key);
}

std::vector<ParameterDescriptor> describe_parameters(const Config& config) {
  ParameterMap keys = config.given;
  std::vector<ParameterDescriptor> descriptors;
  for (const KeySpec& spec : key_table()) {
    if (rule_of(spec.key).empty()) keys.emplace(spec.key, false);
  }
  for (const auto& [key, unused] : keys) {
    auto found = describe_parameter(key, config.role);
    if (!found) continue;
    if (const auto given = config.given.find(key); given != config.given.end()) {
      found->value = value_to_show(*find_key(key), given->second);
    }
    descriptors.push_back(std::move(*found));
  }
  return descriptors;
}

}  // namespace connect_bridge
