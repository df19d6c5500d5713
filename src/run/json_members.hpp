// Reading a status that another program, or another version, may have written: what is not there
// counts as nothing.
#pragma once

#include <cstddef>
#include <cstdio>
#include <ctime>
#include <optional>
#include <string>
#include <type_traits>

#include "core/base/json.hpp"
#include "core/wire/text.hpp"

namespace connect_bridge {

// A text, a bool or a number; `otherwise`, if the member is missing or something else. Of a text
// what a terminal may show, at most `text_bytes`.
template <class T>
[[nodiscard]] T member(const Json& of, const char* name, T otherwise = {},
                       std::size_t text_bytes = 200) {
  const auto found = of.find(name);
  if (found == of.end()) return otherwise;
  if constexpr (std::is_same_v<T, std::string>)
    return found->is_string() ? to_text(found->template get<std::string>(), text_bytes) : otherwise;
  else if constexpr (std::is_same_v<T, bool>)
    return found->is_boolean() ? found->template get<bool>() : otherwise;
  else
    return found->is_number() ? found->template get<T>() : otherwise;
}

// The moment of a member like "2026-01-31T12:00:00.123Z", in seconds since 1970.
[[nodiscard]] inline std::optional<double> moment_in(const Json& of, const char* name) {
  std::tm parts{};
  double seconds = 0;
  if (std::sscanf(member<std::string>(of, name).c_str(), "%d-%d-%dT%d:%d:%lf", &parts.tm_year,
                  &parts.tm_mon, &parts.tm_mday, &parts.tm_hour, &parts.tm_min, &seconds) != 6)
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
