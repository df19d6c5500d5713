#include "core/wire/control_shape.hpp"

#include "core/wire/control.hpp"

namespace connect_bridge {

Result<Nothing> check_control_shape(std::string_view text) {
  std::size_t depth = 0;
  std::size_t values = 1;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      // The character behind it ends no string, whatever it is.
      if (c == '\\') ++i;
      if (c == '"') in_string = false;
      continue;
    }
    if (c == '"') in_string = true;
    if (c == '{' || c == '[') ++depth;
    if ((c == '}' || c == ']') && depth > 0) --depth;
    // A value follows each of these, but for an empty object or list, which counts as one more.
    if (c == ',' || c == '{' || c == '[') ++values;
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
