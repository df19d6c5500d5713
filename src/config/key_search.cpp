#include "config/key_search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numeric>

#include "config/syntax.hpp"

namespace connect_bridge {
namespace {

constexpr std::string_view kRule = "rule.";
constexpr std::string_view kTemplate = "rule.<name>.";

// Every known key of the role, with the templates filled in for `rule`.
std::vector<std::string> candidates(Role role, std::string_view rule) {
  std::vector<std::string> keys;
  for (const KeySpec& spec : key_table()) {
    if (!is_used_by(spec, role)) continue;
    if (!spec.key.starts_with(kTemplate) || !rule.empty()) keys.push_back(key_of(spec, rule));
  }
  return keys;
}

std::string number_text(double value) {
  return fmt::format("{:.15g}", value);
}

}  // namespace

std::string key_of(const KeySpec& spec, std::string_view rule) {
  if (!spec.key.starts_with(kTemplate)) return spec.key;
  return fmt::format("{}{}.{}", kRule, rule, spec.key.substr(kTemplate.size()));
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

const std::vector<std::string>& secret_arguments() {
  static const std::vector<std::string> arguments = [] {
    std::vector<std::string> made;
    for (const KeySpec& spec : key_table())
      if (spec.secret) made.push_back(spec.key + ":=");
    return made;
  }();
  return arguments;
}

bool is_used_by(const KeySpec& spec, Role role) {
  return spec.used_by == UsedBy::kBoth ||
         (spec.used_by == UsedBy::kServer) == (role == Role::kServer);
}

std::string_view rule_of(std::string_view key) {
  if (!key.starts_with(kRule)) return {};
  const std::string_view rest = key.substr(kRule.size());
  const std::size_t dot = rest.find('.');
  if (dot == std::string_view::npos || dot + 1 == rest.size()) return {};
  return rest.substr(0, dot);
}

const KeySpec* find_key(std::string_view key) {
  std::string name{key};
  if (const std::string_view rule = rule_of(key); !rule.empty()) {
    name = fmt::format("{}{}", kTemplate, key.substr(kRule.size() + rule.size() + 1));
  }
  const auto& table = key_table();
  const auto row = std::find_if(table.begin(), table.end(),
                                [&](const KeySpec& spec) { return spec.key == name; });
  return row == table.end() ? nullptr : &*row;
}

bool is_ros_key(std::string_view key) {
  return key == kUseSimTime || key == "start_type_description_service" ||
         key.starts_with("qos_overrides.");
}

std::string nearest_key(std::string_view key, Role role) {
  // "rules.drive.types" and "drive.types" are common mistakes.
  std::string asked{key};
  if (asked.starts_with("rules.")) asked.replace(0, 6, kRule);
  if (rule_of(asked).empty() && find_key(fmt::format("rule.{}", asked)) != nullptr) {
    return fmt::format("rule.{}", asked);
  }
  std::string best;
  std::size_t best_distance = std::max<std::size_t>(2, asked.size() / 4) + 1;
  const Role other = role == Role::kServer ? Role::kClient : Role::kServer;
  // Keys of the other role come second, so they win only if they are nearer.
  for (const Role of : {role, other}) {
    for (const std::string& candidate : candidates(of, rule_of(asked))) {
      // A part of a key ("listen", "port") means the first key that contains it.
      const bool part = candidate.starts_with(asked + ".") || candidate.ends_with("." + asked);
      const std::size_t found = std::min(edit_distance(asked, candidate), part ? 1 : best_distance);
      if (found < best_distance) {
        best_distance = found;
        best = candidate;
      }
    }
  }
  return best;
}

std::string_view type_text(ParameterType type) {
  switch (type) {
    case ParameterType::kBool: return "bool";
    case ParameterType::kInteger: return "integer";
    case ParameterType::kDouble: return "number";
    case ParameterType::kString: return "string";
    case ParameterType::kStrings: return "list of strings";
    default: return "";  // no row has another type
  }
}

std::string nearest_of(const std::vector<std::string>& words, std::string_view given) {
  std::string best;
  std::size_t least = 3;  // typing errors
  for (const std::string& word : words) {
    const std::size_t distance = edit_distance(given, word);
    if (distance >= least) continue;
    least = distance;
    best = word;
  }
  return best;
}

std::string expected_of(const KeySpec& spec) {
  std::string range;
  if (spec.range) {
    range =
        fmt::format(" from {} to {}", number_text(spec.range->min), number_text(spec.range->max));
  }
  switch (spec.type) {
    case ParameterType::kBool: return "true or false";
    case ParameterType::kInteger: return "a whole number" + range;
    case ParameterType::kDouble: return "a number" + range;
    case ParameterType::kString:
      if (!spec.words.empty()) return fmt::format("one of {}", fmt::join(spec.words, ", "));
      // The complaint about an empty text describes best what the text should be.
      if (spec.syntax != nullptr) return spec.syntax("").value_or("a string");
      return "a string";
    case ParameterType::kStrings: return "a list of strings";
    default: return "";
  }
}

std::optional<ParameterValue> value_in(const ParameterMap& given, const KeySpec& spec,
                                       std::string_view key) {
  const auto found = given.find(key);
  return found == given.end() ? spec.fallback : found->second;
}

ParameterValue value_to_show(const KeySpec& spec, const ParameterValue& value) {
  constexpr std::array<std::string_view, 3> kUrls = {"url", "auth.service", "auth.jwt_keys"};
  const auto* text = std::get_if<std::string>(&value);
  if (text == nullptr || std::find(kUrls.begin(), kUrls.end(), spec.key) == kUrls.end())
    return value;
  return syntax::url_to_show(*text);
}

}  // namespace connect_bridge
