// What a change of the configuration means.
#pragma once

#include <string>
#include <vector>

#include "config/config.hpp"

namespace connect_bridge {

// Names of rules in use, before and after a change.
struct RuleChanges {
  std::vector<std::string> added, changed, removed;
  bool reordered = false;  // of those that stay
  [[nodiscard]] bool none() const {
    return added.empty() && changed.empty() && removed.empty() && !reordered;
  }
};

[[nodiscard]] RuleChanges rule_changes(const Config& before, const Config& after);
// Which keys beside the rules have another value.
[[nodiscard]] std::vector<std::string> settings_changed(const Config& before, const Config& after);
// "1 added (watch), 2 changed (a, b)", "none changed"; for log lines.
[[nodiscard]] std::string to_text(const RuleChanges& changes);

// What a parameter file that was read again changes in a running program.
struct FileChanges {
  std::vector<Parameter> changes;  // for apply_change(); without a value: not in the file now
  std::vector<std::string> fixed;  // keys that differ and need a restart
  std::vector<Problem> problems;   // why it would not start: nothing is to be changed
};

// The file is checked as a whole, as at a start, with the token as it was then.
[[nodiscard]] FileChanges file_changes(const Config& current, const ParameterMap& file,
                                       const Surroundings& surroundings);

}  // namespace connect_bridge
