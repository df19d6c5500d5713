#include "core/wire/control_shape.hpp"

#include "core/wire/control.hpp"

namespace connect_bridge {

Result<Nothing> check_control_shape(std::string_view text) {
  std::size_t depth = 0;
  std::size_t values = 1;
  bool in_string = false;
  bool opened = false;  // an object or list, and nothing of it has come yet
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      // The character behind it ends no string, whatever it is.
      if (c == '\\') ++i;
      if (c == '"') in_string = false;
      continue;
    }
    if (c == ' ' || c == '\t' || c == '\n' || c == '\r') continue;
    const bool opens = c == '{' || c == '[';
    const bool closes = c == '}' || c == ']';
    if (c == '"') in_string = true;
    if (opens) ++depth;
    if (closes && depth > 0) --depth;
    // Each value but the first of all is the first in an object or list, or follows a comma.
    if (c == ',' || (opened && !closes)) ++values;
    opened = opens;
    if (depth > kControlDepthMax) {
      return Error{CloseCode::kTooLarge, "a control message is nested too deeply"};
    }
    if (values > kControlValuesMax) {
      return Error{CloseCode::kTooLarge, "a control message has too many values"};
    }
  }
  return Nothing{};
}

}  // namespace connect_bridge
