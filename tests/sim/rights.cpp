#include "sim/rights.hpp"

#include <algorithm>
#include <span>
#include <string_view>
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

}  // namespace

std::optional<Treatment> treatment_of(const Policy& policy, Direction direction,
                                      const std::string& name, const std::string& type,
                                      const Identity& who) {
  if (name == "/parameter_events") return {};
  for (const auto& token : split(name)) {
    if (token == "_action") return {};
  }
  for (const auto& rule : policy.rules()) {
    if (speaks_of(rule, who) && any_fits(rule.deny, name, true)) return {};
  }
  for (const auto& rule : policy.rules()) {
    if (!speaks_of(rule, who)) continue;
    const bool type_fits = rule.types.empty() || std::find(rule.types.begin(), rule.types.end(),
                                                           type) != rule.types.end();
    const auto& allowed = direction == Direction::kExport ? rule.export_topics : rule.import_topics;
    if (type_fits && any_fits(allowed, name, false)) return rule.treatment;
  }
  return {};
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
