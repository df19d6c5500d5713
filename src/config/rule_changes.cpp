#include "config/rule_changes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "config/key_search.hpp"

namespace connect_bridge {
namespace {

constexpr std::size_t kNamesTold = 10;

std::vector<std::string> names_of(const Config& config) {
  std::vector<std::string> names;
  for (const Rule& rule : config.policy.rules()) names.push_back(rule.name);
  return names;
}

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

ParameterMap keys_of(const Config& config, const std::string& rule) {
  ParameterMap keys;
  for (const auto& [key, value] : config.given)
    if (rule_of(key) == rule) keys.emplace(key, value);
  return keys;
}

std::string list_of(const std::vector<std::string>& names, const char* what) {
  if (names.empty()) return {};
  const auto first = std::span(names).first(std::min(names.size(), kNamesTold));
  return fmt::format(", {} {} ({}{})", names.size(), what, fmt::join(first, ", "),
                     names.size() > first.size() ? ", ..." : "");
}

}  // namespace

RuleChanges rule_changes(const Config& before, const Config& after) {
  RuleChanges changes;
  const auto old_names = names_of(before);
  const auto new_names = names_of(after);
  std::vector<std::string> stay_old;
  std::vector<std::string> stay_new;
  for (const auto& name : old_names)
    (contains(new_names, name) ? stay_old : changes.removed).push_back(name);
  for (const auto& name : new_names)
    (contains(old_names, name) ? stay_new : changes.added).push_back(name);
  for (const auto& name : stay_new)
    if (keys_of(before, name) != keys_of(after, name)) changes.changed.push_back(name);
  changes.reordered = stay_old != stay_new;
  return changes;
}

std::string to_text(const RuleChanges& changes) {
  if (changes.none()) return "none changed";
  std::string text = list_of(changes.added, "added") + list_of(changes.changed, "changed") +
                     list_of(changes.removed, "removed");
  if (changes.reordered) text += ", in another order";
  return text.substr(2);
}

std::vector<std::string> settings_changed(const Config& before, const Config& after) {
  std::vector<std::string> changed;
  for (const KeySpec& spec : key_table()) {
    if (!spec.changeable || !rule_of(spec.key).empty() || spec.key == "rules") continue;
    if (value_in(before.given, spec, spec.key) != value_in(after.given, spec, spec.key))
      changed.push_back(spec.key);
  }
  return changed;
}

FileChanges file_changes(const Config& current, const ParameterMap& file,
                         const Surroundings& surroundings) {
  FileChanges found;
  Surroundings around = surroundings;
  around.token_in_environment |= current.token_in_environment;
  const Parsed whole = parse_config(file, current.role, around, ReadAt::kRunning);
  found.problems = whole.problems;
  // An operator who removes the list does not want the default rules.
  if (!current.is_robot() && current.given.contains("rules") && !file.contains("rules"))
    found.problems.push_back({"rules", "", "a list: without one the default rules would hold"});
  if (!found.problems.empty()) return found;
  const ParameterMap& now = whole.config->given;
  const auto compare = [&](const std::string& key, std::optional<ParameterValue> value) {
    const KeySpec* spec = find_key(key);
    if (spec == nullptr) return;
    const bool differs = value_in(current.given, *spec, key) != value_in(now, *spec, key);
    // A key of a rule also counts as changed when it appears or disappears.
    const bool is_of_rules = !rule_of(key).empty() || key == "rules";
    const bool came_or_went = is_of_rules && current.given.contains(key) != now.contains(key);
    if (!spec->changeable) {
      if (differs) found.fixed.push_back(key);
    } else if (differs || came_or_went) {
      found.changes.push_back({key, std::move(value)});
    }
  };
  for (const auto& [key, value] : now) compare(key, value);
  for (const auto& [key, value] : current.given)
    if (!now.contains(key)) compare(key, std::nullopt);
  return found;
}

}  // namespace connect_bridge
