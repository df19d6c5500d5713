// The parameters of the node and the rules for changing them, without ROS.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "ros/parameters/parameter.hpp"

namespace connect_bridge::ros {

// The content of a message on /parameter_events.
struct ParameterDifferences {
  std::vector<Parameter> added, changed, removed;
  [[nodiscard]] bool empty() const { return added.empty() && changed.empty() && removed.empty(); }
};

class ParameterTable {
 public:
  using Set = std::function<SetResult(const std::vector<Parameter>&)>;
  using Describe = std::function<std::optional<ParameterDescriptor>(const std::string& name)>;

  explicit ParameterTable(std::vector<ParameterDescriptor> entries);

  // All or none: checks names, types and ranges, calls `set`, then changes the entries.
  SetResult apply(std::vector<Parameter> parameters, const Set& set, const Describe& describe,
                  ParameterDifferences& differences);

  [[nodiscard]] const ParameterDescriptor* find(const std::string& name) const;
  [[nodiscard]] const std::vector<ParameterDescriptor>& entries() const { return entries_; }

 private:
  ParameterDescriptor* find_mutable(const std::string& name);
  SetResult check(Parameter& parameter, const Describe& describe,
                  std::vector<ParameterDescriptor>& described) const;
  void change(const Parameter& parameter, std::vector<ParameterDescriptor>& described,
              ParameterDifferences& differences);

  std::vector<ParameterDescriptor> entries_;  // sorted by name
};

}  // namespace connect_bridge::ros
