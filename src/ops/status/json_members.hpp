// Reading a status that another program, or another version, may have written: what is not there
// counts as nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <optional>
#include <string>

#include "core/base/json.hpp"
#include "core/wire/text.hpp"

namespace connect_bridge {

// The text of a member: only what a terminal may show, and not more than a name may have.
[[nodiscard]] inline std::string text_in(const Json& of, const char* name) {
  constexpr std::size_t kTextBytes = 300;
  const auto found = of.find(name);
  return found != of.end() && found->is_string() ? to_text(found->get<std::string>(), kTextBytes)
                                                 : std::string{};
}

[[nodiscard]] inline double number_in(const Json& of, const char* name) {
  const auto found = of.find(name);
  return found != of.end() && found->is_number() ? found->get<double>() : 0;
}

[[nodiscard]] inline std::uint64_t count_in(const Json& of, const char* name) {
  const auto found = of.find(name);
  return found != of.end() && found->is_number() ? found->get<std::uint64_t>() : 0;
}

[[nodiscard]] inline bool is_set(const Json& of, const char* name) {
  const auto found = of.find(name);
  return found != of.end() && found->is_boolean() && found->get<bool>();
}

// The moment of a member like "2026-01-31T12:00:00.123Z", in seconds since 1970.
[[nodiscard]] inline std::optional<double> moment_in(const Json& of, const char* name) {
  std::tm parts{};
  double seconds = 0;
  if (std::sscanf(text_in(of, name).c_str(), "%d-%d-%dT%d:%d:%lf", &parts.tm_year, &parts.tm_mon,
                  &parts.tm_mday, &parts.tm_hour, &parts.tm_min, &seconds) != 6)
    return std::nullopt;
  parts.tm_year -= 1900;
  parts.tm_mon -= 1;
  return static_cast<double>(::timegm(&parts)) + seconds;
}

// A list or an object; an empty one, if the member is missing or something else.
[[nodiscard]] inline const Json& part_of(const Json& of, const char* name) {
  static const Json none = Json::object();
  const auto found = of.find(name);
  return found != of.end() && found->is_structured() ? *found : none;
}

}  // namespace connect_bridge
