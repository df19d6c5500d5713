#include "config/parameter.hpp"

#include <fmt/format.h>

#include <type_traits>

namespace connect_bridge {
namespace {

std::string scalar_text(bool value) {
  return value ? "true" : "false";
}
std::string scalar_text(std::int64_t value) {
  return std::to_string(value);
}
std::string scalar_text(const std::string& value) {
  return fmt::format("\"{}\"", value);
}

// A number with a point or an exponent, so that a reader sees it is not an integer.
std::string scalar_text(double value) {
  std::string text = fmt::format("{}", value);
  if (text.find_first_of(".en") == std::string::npos) text += ".0";
  return text;
}

template <class T>
std::string list_text(const std::vector<T>& values) {
  std::vector<std::string> texts;
  for (const auto& value : values) texts.push_back(scalar_text(value));
  return fmt::format("[{}]", fmt::join(texts, ", "));
}

}  // namespace

std::string to_text(const ParameterValue& value) {
  return std::visit(
      [](const auto& held) {
        using Held = std::decay_t<decltype(held)>;
        if constexpr (std::is_same_v<Held, bool> || std::is_same_v<Held, std::int64_t> ||
                      std::is_same_v<Held, double> || std::is_same_v<Held, std::string>) {
          return scalar_text(held);
        } else if constexpr (std::is_same_v<Held, Bytes>) {
          return fmt::format("{} bytes", held.size());
        } else {
          return list_text(held);
        }
      },
      value);
}

Cause cause_of_key(std::string_view key) {
  if (key == "url") return Cause::kUrlWrong;
  if (key == "prefix" || key == "remap") return Cause::kPrefixWrong;
  if (key == "rules" || key.starts_with("rule.")) return Cause::kRuleWrong;
  if (key == "auth.token" || key == "auth.token_file") return Cause::kTokenMissing;
  for (const std::string_view file : {"tls.certificate", "tls.private_key", "tls.ca"})
    if (key == file) return Cause::kCertificateFiles;
  return Cause::kValueWrong;
}

std::string to_text(const Problem& problem) {
  if (problem.value.empty()) return fmt::format("{}: expected {}", problem.key, problem.expected);
  return fmt::format("{}: {} is wrong, expected {}", problem.key, problem.value, problem.expected);
}

}  // namespace connect_bridge
