// Patterns of ROS names: `*` stands for any characters within one token, `**` for any number of
// tokens.
#pragma once

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "core/wire/control.hpp"

namespace connect_bridge {

// Whether wildcards stand for hidden tokens (those that begin with '_') too.
enum class Hidden : std::uint8_t { kSpelledOut, kAny };

// Patterns with wildcards, compiled: a name is read once by all of them at a time, and what a
// character of it costs is bounded by the sum of their lengths, whatever the texts are. Immutable.
class PatternSet {
 public:
  using Members = std::bitset<kWildcardsMax>;

  // Each text is a pattern (is_pattern) with a wildcard. They are at most kWildcardsMax, and from
  // their first stars on at most kWildcardBytesMax long together.
  explicit PatternSet(const std::vector<std::string_view>& texts);

  // The patterns that match `name`, by their places in `texts`. The name must be canonical. Does
  // not allocate.
  [[nodiscard]] Members matching(std::string_view name, Hidden hidden) const;

 private:
  static constexpr char kFirst = '/';
  static constexpr char kLast = 'z';  // all characters of names are between them
  // A bit for each place of a pattern.
  static constexpr std::size_t kBits = 64;
  static constexpr std::size_t kWordsMax = (kWildcardBytesMax + kWildcardsMax) / kBits;
  using Words = std::vector<std::uint64_t>;

  struct Member {
    std::string prefix;  // up to its first star
    std::size_t place;   // of that star
  };
  class Reader;

  void compile(std::string_view text);

  std::vector<Member> members_;  // by the lengths of their prefixes
  std::vector<std::size_t> last_places_;
  std::size_t size_ = 0;  // places
  // `**`, `*`, first characters of tokens, and where a pattern has been read to its end.
  Words any_, stars_, first_, ends_;
  std::vector<Words> literal_;  // by the character, from kFirst on
};

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
  [[nodiscard]] bool matches(std::string_view name) const {
    return matches(name, Hidden::kSpelledOut);
  }
  // For patterns that deny: like matches(), but wildcards match hidden tokens too, so that a deny
  // of all names below one also denies the hidden ones.
  [[nodiscard]] bool covers(std::string_view name) const { return matches(name, Hidden::kAny); }

  [[nodiscard]] const std::string& text() const { return text_; }
  friend bool operator==(const Pattern& a, const Pattern& b) { return a.text_ == b.text_; }

 private:
  explicit Pattern(std::string_view text);
  [[nodiscard]] bool matches(std::string_view name, Hidden hidden) const {
    return compiled_ ? compiled_->matching(name, hidden).any() : name == text_;
  }

  std::string text_;
  std::shared_ptr<const PatternSet> compiled_;  // null: it has no wildcard
};

[[nodiscard]] inline bool has_wildcard(std::string_view pattern) {
  return pattern.find('*') != std::string_view::npos;
}
// Whether Pattern::parse() would take it.
[[nodiscard]] bool is_pattern(std::string_view text);

// Absolute, no empty token, no trailing '/', only [A-Za-z0-9_], no token starting with a digit, at
// most 255 bytes.
[[nodiscard]] bool is_canonical_name(std::string_view name);
// "package/msg/Type" (or srv, action) with valid identifiers.
[[nodiscard]] bool is_type_name(std::string_view type);

}  // namespace connect_bridge
