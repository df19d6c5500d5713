// Reading a status that another program, or another version, may have written: what is not there
// counts as nothing.
#pragma once

#include <cstddef>
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

// A list or an object; an empty one, if the member is missing or something else.
[[nodiscard]] inline const Json& part_of(const Json& of, const char* name) {
  static const Json none = Json::object();
  const auto found = of.find(name);
  return found != of.end() && found->is_structured() ? *found : none;
}

}  // namespace connect_bridge
