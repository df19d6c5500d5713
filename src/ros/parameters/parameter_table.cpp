#include "ros/parameters/parameter_table.hpp"

#include <algorithm>
#include <utility>

namespace connect_bridge::ros {
namespace {

bool by_name(const ParameterDescriptor& a, const ParameterDescriptor& b) {
  return a.name < b.name;
}

ParameterDescriptor* find_in(std::vector<ParameterDescriptor>& entries, const std::string& name) {
  const auto found =
      std::find_if(entries.begin(), entries.end(),
                   [&](const ParameterDescriptor& entry) { return entry.name == name; });
  return found == entries.end() ? nullptr : &*found;
}

}  // namespace

ParameterTable::ParameterTable(std::vector<ParameterDescriptor> entries)
    : entries_(std::move(entries)) {
  std::sort(entries_.begin(), entries_.end(), by_name);
}

ParameterDescriptor* ParameterTable::find_mutable(const std::string& name) {
  const auto found = std::lower_bound(
      entries_.begin(), entries_.end(), name,
      [](const ParameterDescriptor& e, const std::string& n) { return e.name < n; });
  return found == entries_.end() || found->name != name ? nullptr : &*found;
}

const ParameterDescriptor* ParameterTable::find(const std::string& name) const {
  return const_cast<ParameterTable*>(this)->find_mutable(name);
}

SetResult ParameterTable::apply(std::vector<Parameter> parameters, const Set& set,
                                const Describe& describe, ParameterDifferences& differences) {
  std::vector<ParameterDescriptor> described;
  for (Parameter& parameter : parameters) {
    const SetResult result = check(parameter, describe, described);
    if (!result.successful) return result;
  }
  if (set) {
    const SetResult result = set(parameters);
    if (!result.successful) return result;
  }
  for (const Parameter& parameter : parameters) change(parameter, described, differences);
  return {};
}

SetResult ParameterTable::check(Parameter& parameter, const Describe& describe,
                                std::vector<ParameterDescriptor>& described) const {
  const std::string& name = parameter.name;
  const ParameterDescriptor* entry = find(name);
  if (entry == nullptr) entry = find_in(described, name);
  if (entry == nullptr && describe && parameter.value) {
    if (auto made = describe(name)) {
      made->value.reset();
      entry = &described.emplace_back(std::move(*made));
    }
  }
  if (entry == nullptr) {
    return {false, "parameter '" + name + "' cannot be set because it was not declared"};
  }
  if (entry->read_only) {
    return {false, "parameter '" + name + "' cannot be set because it is read-only"};
  }
  if (!parameter.value) {
    // Only a parameter that could be added again can be removed.
    if (describe && describe(name)) return {};
    return {false, "parameter '" + name + "' cannot be removed"};
  }
  return check_value(*entry, *parameter.value);
}

void ParameterTable::change(const Parameter& parameter, std::vector<ParameterDescriptor>& described,
                            ParameterDifferences& differences) {
  ParameterDescriptor* entry = find_mutable(parameter.name);
  if (!parameter.value) {
    if (entry == nullptr) return;
    differences.removed.push_back({entry->name, entry->value});
    entries_.erase(entries_.begin() + (entry - entries_.data()));
    return;
  }
  if (entry == nullptr) {
    ParameterDescriptor* made = find_in(described, parameter.name);
    if (made == nullptr) return;
    made->value = parameter.value;
    entries_.insert(std::upper_bound(entries_.begin(), entries_.end(), *made, by_name), *made);
    differences.added.push_back(parameter);
    return;
  }
  entry->value = parameter.value;
  differences.changed.push_back(parameter);
}

}  // namespace connect_bridge::ros
