#include "core/policy/pattern.hpp"

#include "core/wire/control.hpp"

namespace connect_bridge {
namespace {

enum class Hidden : std::uint8_t { kSpelledOut, kAny };

// std::isalnum depends on the locale; names do not.
bool is_digit(char c) {
  return c >= '0' && c <= '9';
}
bool is_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}
bool is_name_char(char c) {
  return is_letter(c) || is_digit(c) || c == '_';
}

// The tokens of "/a/b/c", one after the other.
class Tokens {
 public:
  explicit Tokens(std::string_view name) : name_(name) { load(1); }

  [[nodiscard]] bool done() const { return begin_ > name_.size(); }
  [[nodiscard]] bool last() const { return end_ == name_.size(); }
  [[nodiscard]] std::string_view token() const { return name_.substr(begin_, end_ - begin_); }
  void advance() { load(end_ + 1); }

 private:
  void load(std::size_t begin) {
    begin_ = begin;
    if (done()) return;
    end_ = name_.find('/', begin);
    if (end_ == std::string_view::npos) end_ = name_.size();
  }
  std::string_view name_;
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
};

bool is_hidden(std::string_view token) {
  return !token.empty() && token.front() == '_';
}

// Going back to the last `*` is enough: what an earlier one could match, the last one can match as
// well.
bool token_matches(std::string_view pattern, std::string_view token, Hidden hidden) {
  if (hidden == Hidden::kSpelledOut && is_hidden(token) && !is_hidden(pattern)) return false;
  std::size_t p = 0;
  std::size_t t = 0;
  std::size_t star = std::string_view::npos;
  std::size_t star_end = 0;
  while (t < token.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      star_end = t;
    } else if (p < pattern.size() && pattern[p] == token[t]) {
      ++p;
      ++t;
    } else if (star != std::string_view::npos) {
      p = star + 1;
      t = ++star_end;
    } else {
      return false;
    }
  }
  while (p < pattern.size() && pattern[p] == '*') ++p;
  return p == pattern.size();
}

// The same walk over tokens. It is correct although `**` may not match hidden tokens: a pattern
// token decides whether the token that it matches may be hidden, so where a later position would
// match, the tokens between are visible.
bool tokens_match(std::string_view pattern, std::string_view name, Hidden hidden) {
  Tokens p(pattern);
  Tokens n(name);
  struct {
    bool seen = false;
    Tokens after;  // pattern after the last `**`
    Tokens taken;  // first token of the name that this `**` does not match
  } back{false, p, n};
  while (true) {
    if (!p.done() && p.token() == "**") {
      if (p.last() && n.done()) return false;
      p.advance();
      back = {true, p, n};
    } else if (p.done() && n.done()) {
      return true;
    } else if (!p.done() && !n.done() && token_matches(p.token(), n.token(), hidden)) {
      p.advance();
      n.advance();
    } else {
      if (!back.seen || back.taken.done()) return false;
      if (hidden == Hidden::kSpelledOut && is_hidden(back.taken.token())) return false;
      back.taken.advance();
      p = back.after;
      n = back.taken;
    }
  }
}

// What is wrong with a pattern, or null.
const char* fault_of(std::string_view text) {
  if (text.empty() || text.front() != '/') return "an absolute name that starts with '/'";
  if (text.size() > kNameBytesMax) return "at most 255 characters";
  for (Tokens tokens(text); !tokens.done(); tokens.advance()) {
    const auto token = tokens.token();
    if (token.empty()) return "no empty part between or after '/'";
    if (token == "**") continue;
    if (token.find("**") != std::string_view::npos) return "'**' only as a whole part";
    if (is_digit(token.front())) return "no part that starts with a digit";
    for (const char c : token) {
      if (!is_name_char(c) && c != '*') return "only letters, digits, '_', '/' and '*'";
    }
  }
  return nullptr;
}

}  // namespace

Result<Pattern> Pattern::parse(std::string_view text) {
  if (const char* expected = fault_of(text)) {
    return Error{CloseCode::kMalformed, "\"" + std::string(text.substr(0, kNameBytesMax)) +
                                            "\" is not a name pattern: expected " + expected};
  }
  return Pattern{text};
}

bool Pattern::matches(std::string_view name) const {
  return tokens_match(text_, name, Hidden::kSpelledOut);
}
bool Pattern::covers(std::string_view name) const {
  return tokens_match(text_, name, Hidden::kAny);
}

bool pattern_matches(std::string_view pattern, std::string_view name) {
  return fault_of(pattern) == nullptr && tokens_match(pattern, name, Hidden::kSpelledOut);
}
bool pattern_covers(std::string_view pattern, std::string_view name) {
  return fault_of(pattern) == nullptr && tokens_match(pattern, name, Hidden::kAny);
}

bool is_canonical_name(std::string_view name) {
  return name.find('*') == std::string_view::npos && fault_of(name) == nullptr;
}

bool is_type_name(std::string_view type) {
  if (type.size() > kNameBytesMax) return false;
  const auto first = type.find('/');
  if (first == std::string_view::npos) return false;
  const auto second = type.find('/', first + 1);
  if (second == std::string_view::npos) return false;
  const auto kind = type.substr(first + 1, second - first - 1);
  if (kind != "msg" && kind != "srv" && kind != "action") return false;
  for (const auto word : {type.substr(0, first), type.substr(second + 1)}) {
    if (word.empty() || !is_letter(word.front())) return false;
    for (const char c : word) {
      if (!is_name_char(c)) return false;
    }
  }
  return true;
}

}  // namespace connect_bridge
