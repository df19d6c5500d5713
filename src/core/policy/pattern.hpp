// Patterns of ROS names: `*` stands for any characters within one token, `**` for any number of
// tokens.
#pragma once

#include <string>
#include <string_view>

#include "core/base/result.hpp"

namespace connect_bridge {

class Pattern {
 public:
  // `text` must be an absolute ROS name in which tokens may contain `*` or be `**`
  // ("/camera/**", "/map_server/*", "/arm_*/state", "/tf"). The error's message says what was
  // expected.
  static Result<Pattern> parse(std::string_view text);

  // For patterns that allow. A token of `name` that starts with '_' is hidden: it is matched only
  // by a pattern token that starts with '_'. `**` stands for one or more tokens at the end
  // ("/camera/**" is /camera/image and /camera/left/image, not /camera), for none or more
  // elsewhere. `name` must be canonical.
  [[nodiscard]] bool matches(std::string_view name) const;
  // For patterns that deny: like matches(), but wildcards match hidden tokens too, so that a deny
  // of all names below one also denies the hidden ones.
  [[nodiscard]] bool covers(std::string_view name) const;

  [[nodiscard]] const std::string& text() const { return text_; }
  bool operator==(const Pattern&) const = default;

 private:
  explicit Pattern(std::string_view text) : text_(text) {}
  std::string text_;
};

// The same on a pattern's text, for patterns that a peer sent: a text that is not a pattern matches
// nothing. Costs in proportion to the sum of the two lengths, whatever the texts are; never
// allocates.
[[nodiscard]] bool pattern_matches(std::string_view pattern, std::string_view name);
[[nodiscard]] bool pattern_covers(std::string_view pattern, std::string_view name);

// Absolute, no empty token, no trailing '/', only [A-Za-z0-9_], no token starting with a digit, at
// most 255 bytes.
[[nodiscard]] bool is_canonical_name(std::string_view name);
// "package/msg/Type" (or srv, action) with valid identifiers.
[[nodiscard]] bool is_type_name(std::string_view type);

}  // namespace connect_bridge
