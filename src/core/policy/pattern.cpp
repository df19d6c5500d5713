#include "core/policy/pattern.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

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

constexpr std::size_t kPlacesOfWord = 64;

// Reads a name once, by a pattern from the first star of that on. Such a pattern is a row of
// places: one for each character, and one for a `**` with the '/' behind it. What is known after
// each character of the name is at which of them the pattern may be, all at a time: to try one and
// to go back would cost the product of both lengths, and a peer may choose both texts.
template <std::size_t kWords>
class NameReader {
 public:
  // `pattern` has less characters than there are places.
  NameReader(std::string_view pattern, bool at_token, Hidden hidden)
      : at_token_(at_token), hidden_(hidden) {
    for (bool first = at_token; !pattern.empty(); ++size_)
      first = first && pattern.starts_with("**") ? add_any(pattern) : add(pattern, first);
    Carry none;
    words_[0].at = pass_stars(words_[0], 1, none);
  }

  bool matches(std::string_view name) {
    for (const char c : name)
      if (!read(c)) return false;
    // A `**` at the end has read something by now: no name ends where a token begins.
    const Word& last = word_of(size_ - 1);
    return (word_of(size_).at & bit_of(size_)) != 0 ||
           (last.at & last.any & bit_of(size_ - 1)) != 0;
  }

 private:
  static constexpr char kFirst = '/';
  static constexpr char kLast = 'z';  // all characters of names are between them

  // Places, a bit for each.
  struct Word {
    std::uint64_t at = 0;                         // where the pattern may be
    std::uint64_t any = 0, stars = 0, first = 0;  // `**`, `*`, first characters of tokens
    std::array<std::uint64_t, kLast - kFirst + 1> literal{};
  };
  // What goes from one word to the next.
  struct Carry {
    std::uint64_t same = 0, any = 0, stars = 0;
  };

  static std::uint64_t bit_of(std::size_t place) {
    return std::uint64_t{1} << place % kPlacesOfWord;
  }
  static std::size_t row_of(char c) { return static_cast<std::size_t>(c - kFirst); }
  Word& word_of(std::size_t place) { return words_[place / kPlacesOfWord]; }

  // These take what they have added from the pattern, and return whether a token begins there.
  bool add_any(std::string_view& pattern) {
    while (pattern.starts_with("**/**")) pattern.remove_prefix(3);  // several are as much as one
    word_of(size_).any |= bit_of(size_);
    pattern.remove_prefix(std::min<std::size_t>(pattern.size(), 3));
    return true;
  }
  bool add(std::string_view& pattern, bool first) {
    Word& word = word_of(size_);
    const char c = pattern.front();
    (c == '*' ? word.stars : word.literal[row_of(c)]) |= bit_of(size_);
    if (first) word.first |= bit_of(size_);
    pattern.remove_prefix(1);
    return c == '/';
  }

  // The places behind these; `carry` is the one behind the last place of a word.
  static std::uint64_t behind(std::uint64_t places, std::uint64_t& carry) {
    return places << 1 | std::exchange(carry, places >> (kPlacesOfWord - 1));
  }
  // A star may stand for nothing. None has another one of its kind behind it.
  std::uint64_t pass_stars(const Word& word, std::uint64_t at, Carry& carry) const {
    if (at_token_) at |= behind(at & word.any, carry.any);
    return at | behind(at & word.stars, carry.stars);
  }

  // False: the pattern cannot be anywhere any more.
  bool read(char c) {
    if (c < kFirst || c > kLast) return false;
    const bool spelled_out = at_token_ && c == '_' && hidden_ == Hidden::kSpelledOut;
    at_token_ = c == '/';
    Carry carry;
    bool somewhere = false;
    for (Word& word : words_) {
      const auto same = word.at & word.literal[row_of(c)];
      const auto stay = word.at & (at_token_ ? word.any : word.any | word.stars);
      word.at =
          spelled_out ? behind(same & word.first, carry.same) : behind(same, carry.same) | stay;
      word.at = pass_stars(word, word.at, carry);
      somewhere |= word.at != 0;
    }
    return somewhere;
  }

  bool at_token_;  // one begins here
  Hidden hidden_;
  std::size_t size_ = 0;  // the place of the pattern's end
  std::array<Word, kWords> words_;
};

// Costs as much as both texts are long, and what a name's character costs is bounded.
bool text_matches(std::string_view pattern, std::string_view name, Hidden hidden) {
  const auto star = pattern.find('*');
  if (star == std::string_view::npos) return pattern == name;
  if (name.substr(0, star) != pattern.substr(0, star)) return false;
  const bool at_token = pattern[star - 1] == '/';
  const auto left = pattern.substr(star);
  const auto rest = name.substr(star);
  // Most are short.
  if (left.size() < kPlacesOfWord) return NameReader<1>(left, at_token, hidden).matches(rest);
  constexpr std::size_t kWordsMax = kNameBytesMax / kPlacesOfWord + 1;
  return NameReader<kWordsMax>(left, at_token, hidden).matches(rest);
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
  return text_matches(text_, name, Hidden::kSpelledOut);
}
bool Pattern::covers(std::string_view name) const {
  return text_matches(text_, name, Hidden::kAny);
}

bool pattern_matches(std::string_view pattern, std::string_view name) {
  return fault_of(pattern) == nullptr && text_matches(pattern, name, Hidden::kSpelledOut);
}
bool pattern_covers(std::string_view pattern, std::string_view name) {
  return fault_of(pattern) == nullptr && text_matches(pattern, name, Hidden::kAny);
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
