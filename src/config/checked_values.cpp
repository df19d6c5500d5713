#include "config/checked_values.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "config/key_search.hpp"
#include "config/syntax.hpp"
#include "core/base/check.hpp"

namespace connect_bridge {
namespace {

constexpr char kHidden[] = "(hidden)";

// A misspelled "auth.tokn" must not put the token into a log either.
bool may_be_secret(std::string_view key, std::string_view nearest) {
  const KeySpec* spec = find_key(nearest);
  if (spec != nullptr && spec->secret) return true;
  constexpr std::string_view kWords[] = {"auth", "token", "secret", "password"};
  return std::any_of(std::begin(kWords), std::end(kWords), [&](std::string_view word) {
    return key.find(word) != std::string_view::npos;
  });
}

std::string shown(const KeySpec& spec, const ParameterValue& value) {
  const auto* text = std::get_if<std::string>(&value);
  // A password may contain characters that end an address.
  const bool has_login =
      text != nullptr && spec.key == "http_proxy" && text->find('@') != std::string::npos;
  return spec.secret || has_login ? kHidden
                                  : to_text(value_to_show(spec, value));  // mutant: secret_shown
}

// Of a list that was written without its brackets.
std::vector<std::string> entries_of(std::string_view text) {
  std::vector<std::string> entries;
  while (!text.empty()) {
    const auto end = std::min(text.find_first_of(", "), text.size());
    if (end > 0) entries.emplace_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return entries;
}

// What to write instead of a value of the wrong type.
std::string fix_of(const KeySpec& spec, const ParameterValue& value) {
  if (spec.type != ParameterType::kStrings) {
    // A number or a word of yes and no that stands in quotation marks is a text.
    const auto* text = std::get_if<std::string>(&value);
    const bool is_bare = text != nullptr && !text->empty() &&
                         text->find_first_not_of("0123456789.-+eE") == std::string::npos;
    const bool is_quoted =
        text != nullptr &&
        (spec.type == ParameterType::kBool ? *text == "true" || *text == "false" : is_bare);
    return expected_of(spec) + (is_quoted ? ", without quotation marks" : "");
  }
  if (const auto* text = std::get_if<std::string>(&value)) {
    return "a list of strings: " + to_text(ParameterValue{entries_of(*text)});
  }
  return "a list of strings, e.g. [\"one\", \"two\"]";
}

// Complaints about a text of the right type.
syntax::Complaint complaint(const KeySpec& spec, const std::string& text) {
  if (!spec.words.empty() &&
      std::find(spec.words.begin(), spec.words.end(), text) == spec.words.end()) {
    if (spec.type == ParameterType::kStrings)
      return fmt::format("one of {}", fmt::join(spec.words, ", "));
    return expected_of(spec);
  }
  return spec.syntax != nullptr ? spec.syntax(text) : std::nullopt;
}

// Adds problems and returns whether there were any.
bool wrong_texts(const std::string& key, const KeySpec& spec, const ParameterValue& value,
                 std::vector<Problem>& problems) {
  const std::size_t before = problems.size();
  if (const auto* text = std::get_if<std::string>(&value)) {
    if (auto expected = complaint(spec, *text))
      problems.push_back({key, shown(spec, value), *expected});
  }
  if (const auto* texts = std::get_if<std::vector<std::string>>(&value)) {
    std::set<std::string> seen;
    for (const std::string& text : *texts) {
      auto expected = complaint(spec, text);
      if (!expected && !seen.insert(text).second) expected = "each entry only once";
      if (expected) problems.push_back({key, shown(spec, text), *expected});
    }
  }
  return problems.size() != before;
}

Problem unknown_key(const std::string& key, const ParameterValue& value, Role role) {
  const std::string nearest = nearest_key(key, role);
  std::string expected = "a known parameter";
  if (const KeySpec* spec = nearest.empty() ? nullptr : find_key(nearest)) {
    const char* const owner = role == Role::kServer ? "client" : "server";
    expected += fmt::format(
        "; did you mean {}?{}", nearest,
        is_used_by(*spec, role) ? "" : fmt::format(" That is a parameter of the {}", owner));
  } else {
    expected += "; docs/config.md lists them";
  }
  return {key, may_be_secret(key, nearest) ? kHidden : to_text(value), expected,
          Cause::kKeyUnknown};
}

}  // namespace

std::string shown_to_others(std::string_view key, const ParameterValue& value) {
  const KeySpec* spec = find_key(key);
  return spec == nullptr ? kHidden : shown(*spec, value);
}

CheckedValues::CheckedValues(const ParameterMap& given, Role role, std::vector<Problem>& problems) {
  for (const auto& [key, value] : given) {
    // The reader of this key would take another kind of value for false.
    if (key == kUseSimTime && type_of(value) != ParameterType::kBool)
      problems.push_back({key, to_text(value), "true or false"});
    if (is_ros_key(key)) continue;
    keys_.insert(key);
    if (const auto rule = rule_of(key); !rule.empty()) rules_.emplace(rule);
    check(key, value, role, problems);
  }
}

void CheckedValues::check(const std::string& key, const ParameterValue& value, Role role,
                          std::vector<Problem>& problems) {
  const KeySpec* spec = find_key(key);
  if (spec == nullptr) {
    problems.push_back(unknown_key(key, value, role));
    return;
  }
  if (!is_used_by(*spec, role)) {
    const bool server = role == Role::kServer;
    problems.push_back({key, shown(*spec, value),
                        fmt::format("nothing: it is a parameter of the {}, this is a {}",
                                    server ? "client" : "server", server ? "server" : "client"),
                        Cause::kKeyUnknown});
    return;
  }
  ParameterValue fitting = value;
  if (fit(spec->type, spec->range, fitting) != Fit::kYes) {
    problems.push_back({key, shown(*spec, value), fix_of(*spec, value)});
  } else if (!wrong_texts(key, *spec, fitting, problems)) {
    values_.emplace(key, std::move(fitting));
  }
}

template <class T>
T CheckedValues::read(std::string_view key) const {
  const KeySpec* spec = find_key(key);
  CONNECT_CHECK(spec != nullptr);
  const auto value = value_in(values_, *spec, key);
  return value ? std::get<T>(*value) : T{};
}

template <class Target>
void CheckedValues::store_in(Target& target, const std::string& rule) const {
  for (const KeySpec& spec : key_table()) {
    const auto* store = std::get_if<Store<Target>>(&spec.store);
    if (!store) continue;
    if (const auto value = value_in(values_, spec, key_of(spec, rule))) (*store)(target, *value);
  }
}

void CheckedValues::store(Config& config) const {
  store_in(config, {});
}

void CheckedValues::store(Rule& rule) const {
  store_in(rule, rule.name);
}

bool CheckedValues::flag(std::string_view key) const {
  return read<bool>(key);
}
std::int64_t CheckedValues::whole(std::string_view key) const {
  return read<std::int64_t>(key);
}
std::string CheckedValues::text(std::string_view key) const {
  return read<std::string>(key);
}
std::vector<std::string> CheckedValues::list(std::string_view key) const {
  return read<std::vector<std::string>>(key);
}

}  // namespace connect_bridge
