#include "sim/rights.hpp"

#include <algorithm>
#include <map>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

namespace connect_bridge::sim {
namespace {

using Tokens = std::span<const std::string>;

std::vector<std::string> split(const std::string& name) {
  std::vector<std::string> tokens;
  for (std::size_t begin = 1; begin <= name.size();) {
    const std::size_t end = std::min(name.find('/', begin), name.size());
    tokens.push_back(name.substr(begin, end - begin));
    begin = end + 1;
  }
  return tokens;
}

bool token_fits(std::string_view pattern, std::string_view token) {
  if (pattern.empty()) return token.empty();
  if (pattern[0] != '*') {
    return !token.empty() && pattern[0] == token[0] &&
           token_fits(pattern.substr(1), token.substr(1));
  }
  for (std::size_t taken = 0; taken <= token.size(); ++taken) {
    if (token_fits(pattern.substr(1), token.substr(taken))) return true;
  }
  return false;
}

bool hidden(const std::string& token) {
  return !token.empty() && token[0] == '_';
}

// `wide`: wildcards stand for hidden tokens as well (patterns that deny).
bool fits(Tokens pattern, Tokens name, bool wide) {
  if (pattern.empty()) return name.empty();
  if (pattern[0] != "**") {
    if (name.empty()) return false;
    if (!wide && hidden(name[0]) && !hidden(pattern[0])) return false;
    return token_fits(pattern[0], name[0]) && fits(pattern.subspan(1), name.subspan(1), wide);
  }
  const bool at_end = pattern.size() == 1;
  for (std::size_t taken = 0; taken <= name.size(); ++taken) {
    if (taken > 0 && !wide && hidden(name[taken - 1])) return false;
    if (at_end && taken == 0) continue;  // at the end `**` takes at least one token
    if (fits(pattern.subspan(1), name.subspan(taken), wide)) return true;
  }
  return false;
}

bool any_fits(const std::vector<Pattern>& patterns, const std::string& name, bool wide) {
  const auto tokens = split(name);
  return std::any_of(patterns.begin(), patterns.end(), [&](const Pattern& pattern) {
    const auto parts = split(pattern.text());
    return fits(parts, tokens, wide);
  });
}

bool speaks_of(const Rule& rule, const Identity& who) {
  if (rule.identities.empty() && rule.groups.empty()) return true;
  for (const auto& name : rule.identities) {
    if (!name.empty() && name == who.name) return true;
  }
  for (const auto& group : rule.groups) {
    for (const auto& own : who.groups) {
      if (own == group) return true;
    }
  }
  return false;
}

bool has_token(const std::string& name, const std::string& token) {
  const auto tokens = split(name);
  return std::find(tokens.begin(), tokens.end(), token) != tokens.end();
}

// The type of the action that a service or topic may be part of. Cancelling and status are the same
// for all actions, but there is one type of them here.
std::optional<std::string> action_type_of(const std::string& part, const std::string& type) {
  const std::map<std::string, std::string> suffixes = {
      {"send_goal", "_SendGoal"}, {"get_result", "_GetResult"}, {"feedback", "_FeedbackMessage"}};
  if (part == "cancel_goal" && type == "action_msgs/srv/CancelGoal") return kActionType;
  if (part == "status" && type == "action_msgs/msg/GoalStatusArray") return kActionType;
  const auto suffix = suffixes.find(part);
  if (suffix == suffixes.end() || !type.ends_with(suffix->second)) return {};
  if (type.find("/action/") == std::string::npos) return {};
  return type.substr(0, type.size() - suffix->second.size());
}

const std::map<std::string, std::string>& parameter_types() {
  static const std::map<std::string, std::string> kTypes = {
      {"describe_parameters", "rcl_interfaces/srv/DescribeParameters"},
      {"get_parameter_types", "rcl_interfaces/srv/GetParameterTypes"},
      {"get_parameters", "rcl_interfaces/srv/GetParameters"},
      {"list_parameters", "rcl_interfaces/srv/ListParameters"},
      {"set_parameters", "rcl_interfaces/srv/SetParameters"},
      {"set_parameters_atomically", "rcl_interfaces/srv/SetParametersAtomically"}};
  return kTypes;
}

// The treatment of the first rule whose patterns, as `allowed` tells them with the name that they
// must fit, open it; nothing if any rule denies one of `names`. `type` empty: any.
template <class Allowed>
std::optional<Treatment> first_rule(const Policy& policy, const Identity& who,
                                    const std::vector<std::string>& names, const std::string& type,
                                    Allowed allowed) {
  for (const auto& rule : policy.rules()) {
    if (!speaks_of(rule, who)) continue;
    for (const auto& name : names) {
      if (any_fits(rule.deny, name, true)) return {};
    }
  }
  for (const auto& rule : policy.rules()) {
    if (!speaks_of(rule, who)) continue;
    const bool type_fits =
        type.empty() || rule.types.empty() ||
        std::find(rule.types.begin(), rule.types.end(), type) != rule.types.end();
    const auto [patterns, name] = allowed(rule);
    if (type_fits && any_fits(*patterns, *name, false)) return rule.treatment;
  }
  return {};
}

// A part of an action is opened by rules for the action alone. A deny of any part covers all.
std::optional<Treatment> treatment_of_part(const Policy& policy, Direction direction,
                                           const std::string& name, const std::string& type,
                                           const Identity& who,
                                           const std::vector<std::string>& parts) {
  const std::size_t slash = name.rfind('/');
  const std::string last = name.substr(slash + 1);
  const std::string before = name.substr(0, slash);
  const std::string suffix = "/_action";
  if (before.size() <= suffix.size() || !before.ends_with(suffix)) return {};
  if (std::find(parts.begin(), parts.end(), last) == parts.end()) return {};
  const std::string action = before.substr(0, before.size() - suffix.size());
  const auto action_type = action_type_of(last, type);
  if (has_token(action, "_action") || !action_type) return {};
  std::vector<std::string> names = {action};
  for (const char* part : {"send_goal", "cancel_goal", "get_result", "feedback", "status"}) {
    names.push_back(before + "/" + part);
  }
  const bool out = direction == Direction::kExport;
  return first_rule(policy, who, names, *action_type, [&](const Rule& rule) {
    return std::pair{out ? &rule.opens[Direction::kExport][OpenedBy::kActions]
                         : &rule.opens[Direction::kImport][OpenedBy::kActions],
                     &action};
  });
}

}  // namespace

std::optional<Treatment> treatment_of(const Policy& policy, Direction direction,
                                      const std::string& name, const std::string& type,
                                      const Identity& who) {
  if (name == "/parameter_events") return {};
  if (has_token(name, "_action")) {
    return treatment_of_part(policy, direction, name, type, who, {"feedback", "status"});
  }
  return first_rule(policy, who, {name}, type, [&](const Rule& rule) {
    return std::pair{direction == Direction::kExport
                         ? &rule.opens[Direction::kExport][OpenedBy::kTopics]
                         : &rule.opens[Direction::kImport][OpenedBy::kTopics],
                     &name};
  });
}

std::optional<Treatment> service_treatment_of(const Policy& policy, Direction direction,
                                              const std::string& name, const std::string& type,
                                              const Identity& who) {
  const bool out = direction == Direction::kExport;
  const std::size_t slash = name.rfind('/');
  const std::string last = name.substr(slash + 1);
  const std::string before = name.substr(0, slash);
  if (has_token(name, "_action")) {
    return treatment_of_part(policy, direction, name, type, who,
                             {"send_goal", "cancel_goal", "get_result"});
  }
  const auto& parameters = parameter_types();
  const auto parameter = parameters.find(last);
  if (parameter != parameters.end()) {
    if (parameter->second != type) return {};
    return first_rule(policy, who, {name, before}, "", [&](const Rule& rule) {
      return std::pair{out ? &rule.opens[Direction::kExport][OpenedBy::kParameters]
                           : &rule.opens[Direction::kImport][OpenedBy::kParameters],
                       &before};
    });
  }
  return first_rule(policy, who, {name}, type, [&](const Rule& rule) {
    return std::pair{out ? &rule.opens[Direction::kExport][OpenedBy::kServices]
                         : &rule.opens[Direction::kImport][OpenedBy::kServices],
                     &name};
  });
}

bool is_permitted(const Policy& policy, Direction direction, const std::string& name,
                  const std::string& type, const Identity& who) {
  return treatment_of(policy, direction, name, type, who).has_value();
}

std::string Names::to_local(const std::string& wire) const {
  for (const auto& pair : remap) {
    if (pair.wire == wire) return pair.local;
  }
  return prefix + wire;
}

std::optional<std::string> Names::to_wire(const std::string& local) const {
  for (const auto& pair : remap) {
    if (pair.local == local) return pair.wire;
  }
  if (local.compare(0, prefix.size() + 1, prefix + "/") != 0) return {};
  std::string wire = local.substr(prefix.size());
  for (const auto& pair : remap) {
    if (pair.wire == wire) return {};
  }
  return wire;
}

}  // namespace connect_bridge::sim
