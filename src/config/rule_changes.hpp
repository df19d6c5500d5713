// Differences between two configurations: rules, settings, and the parameter file.
#pragma once

#include <string>
#include <vector>

#include "config/config.hpp"

namespace connect_bridge {

// Names of rules in use, before and after a change.
struct RuleChanges {
  std::vector<std::string> added, changed, removed;
  bool reordered = false;  // the rules that stay are in another order
  [[nodiscard]] bool none() const {
    return added.empty() && changed.empty() && removed.empty() && !reordered;
  }
};

// Compares the rules in use before and after a change.
[[nodiscard]] RuleChanges rule_changes(const Config& before, const Config& after);
// Keys beside the rules whose value differs.
[[nodiscard]] std::vector<std::string> settings_changed(const Config& before, const Config& after);
// Text for log lines: "1 added (watch), 2 changed (a, b)", "none changed".
[[nodiscard]] std::string to_text(const RuleChanges& changes);

// Changes that a parameter file, read again, makes in a running program.
struct FileChanges {
  std::vector<Parameter> changes;  // for apply_change(); without a value: not in the file now
  std::vector<std::string> fixed;  // keys that differ and need a restart
  std::vector<Problem> problems;   // reasons why a start would fail; then nothing is changed
};

// Compares a file with the running configuration. The file is checked as a whole, with the token as
// it was at start.
[[nodiscard]] FileChanges file_changes(const Config& current, const ParameterMap& file,
                                       const Surroundings& surroundings);

}  // namespace connect_bridge
