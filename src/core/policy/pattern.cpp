#include "core/policy/pattern.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <utility>

#include "core/base/check.hpp"

namespace connect_bridge {
namespace {

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

std::uint64_t bit_of(std::size_t place) {
  return std::uint64_t{1} << place % 64;
}

// The requirement that a pattern violates, or null.
const char* fault_of(std::string_view text) {
  if (text.empty() || text.front() != '/') return "an absolute name that starts with '/'";
  if (text.size() > kNameBytesMax) return "at most 255 characters";
  for (std::size_t begin = 1; begin <= text.size();) {
    const auto token = text.substr(begin, text.find('/', begin) - begin);
    begin += token.size() + 1;
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

// A pattern is a row of places from its first star on: one for each character, one for a `**` with
// the '/' behind it, and one for its end. What is known after each character of a name is at which
// of them each pattern may be, all at a time: to try one and to go back would cost the product of
// both lengths, and a peer may choose both texts.
PatternSet::PatternSet(const std::vector<std::string_view>& texts) {
  std::size_t bytes = 0;
  for (const auto text : texts) bytes += text.size() - text.find('*');
  CONNECT_CHECK(texts.size() <= kWildcardsMax && bytes <= kWildcardBytesMax);
  const std::size_t words = (bytes + texts.size() + kBits - 1) / kBits;
  for (Words* const of : {&any_, &stars_, &first_, &ends_}) of->resize(words);
  literal_.assign(kLast - kFirst + 1, Words(words));
  for (const auto text : texts) compile(text);
  std::stable_sort(members_.begin(), members_.end(), [](const Member& a, const Member& b) {
    return a.prefix.size() < b.prefix.size();
  });
}

void PatternSet::compile(std::string_view text) {
  const auto mark = [&](Words& words) { words[size_ / kBits] |= bit_of(size_); };
  const auto star = text.find('*');
  members_.push_back({std::string(text.substr(0, star)), size_});
  bool first = text[star - 1] == '/';
  bool any = false;
  for (auto left = text.substr(star); !left.empty(); ++size_) {
    any = first && left.starts_with("**");
    if (any) {
      while (left.starts_with("**/**")) left.remove_prefix(3);  // several are as much as one
      mark(any_);
      left.remove_prefix(std::min<std::size_t>(left.size(), 3));
      continue;
    }
    const char c = left.front();
    mark(c == '*' ? stars_ : literal_[static_cast<std::size_t>(c - kFirst)]);
    if (first) mark(first_);
    left.remove_prefix(1);
    first = c == '/';
  }
  mark(ends_);
  // A `**` at the end has read something by then: no name ends where a token begins.
  if (any) ends_[(size_ - 1) / kBits] |= bit_of(size_ - 1);
  last_places_.push_back(size_++);
}

// The places in the patterns that a name may have reached while it is read.
class PatternSet::Reader {
 public:
  Reader(const PatternSet& set, std::string_view name, Hidden hidden)
      : set_(set),
        name_(name),
        hidden_(hidden),
        words_(set.any_.size()),
        any_(set.any_.data()),
        stars_(set.stars_.data()),
        first_(set.first_.data()) {
    std::fill_n(at_.begin(), words_, 0);
  }

  Members read() {
    auto next = set_.members_.begin();
    const auto end = set_.members_.end();
    std::size_t i = 0;  // so many characters were read
    while (true) {
      // While no pattern has begun, the reader skips to the place where the next one may.
      if (!somewhere_) {
        if (next == end || next->prefix.size() > name_.size()) return {};
        i = next->prefix.size();
      }
      at_token_ = i > 0 && name_[i - 1] == '/';
      const auto begin = next;
      for (; next != end && next->prefix.size() == i; ++next)
        if (name_.starts_with(next->prefix)) begin_at(next->place);
      if (next != begin) pass_stars();
      if (i == name_.size()) return ended();
      if (somewhere_) step(name_[i++]);
    }
  }

 private:
  // Bits that one word hands on to the next.
  struct Carry {
    std::uint64_t same = 0, any = 0, stars = 0;
    [[nodiscard]] bool none() const { return (same | any | stars) == 0; }
  };

  void begin_at(std::size_t place) {
    at_[place / kBits] |= bit_of(place);
    somewhere_ = true;
  }
  // The places behind these; `carry` is the one behind the last place of a word.
  static std::uint64_t behind(std::uint64_t places, std::uint64_t& carry) {
    return places << 1 | std::exchange(carry, places >> (kBits - 1));
  }
  // A star may stand for nothing. None has another one of its kind behind it.
  [[nodiscard]] std::uint64_t past_stars(std::size_t word, std::uint64_t at, Carry& carry) const {
    if (at_token_) at |= behind(at & any_[word], carry.any);
    return at | behind(at & stars_[word], carry.stars);
  }
  void pass_stars() {
    Carry carry;
    for (std::size_t i = 0; i < words_; ++i) at_[i] = past_stars(i, at_[i], carry);
  }

  void step(char c) {
    somewhere_ = false;
    if (c < kFirst || c > kLast) {
      std::fill_n(at_.begin(), words_, 0);
      return;
    }
    const bool spelled_out =
        at_token_ && c == '_' && hidden_ == Hidden::kSpelledOut;  // mutant: hidden_names
    at_token_ = c == '/';
    const std::uint64_t* const literal = set_.literal_[static_cast<std::size_t>(c - kFirst)].data();
    Carry carry;
    for (std::size_t i = 0; i < words_; ++i) {
      if (at_[i] == 0 && carry.none()) continue;
      const auto same = at_[i] & literal[i];
      const auto stay = at_[i] & (at_token_ ? any_[i] : any_[i] | stars_[i]);
      const auto at =
          spelled_out ? behind(same & first_[i], carry.same) : behind(same, carry.same) | stay;
      at_[i] = past_stars(i, at, carry);
      somewhere_ = somewhere_ || at_[i] != 0;
    }
  }

  [[nodiscard]] Members ended() const {
    Members members;
    for (std::size_t i = 0; i < words_; ++i) {
      for (auto left = at_[i] & set_.ends_[i]; left != 0; left &= left - 1) {
        const std::size_t place = i * kBits + static_cast<std::size_t>(std::countr_zero(left));
        const auto& last = set_.last_places_;
        members.set(static_cast<std::size_t>(std::lower_bound(last.begin(), last.end(), place) -
                                             last.begin()));
      }
    }
    return members;
  }

  const PatternSet& set_;
  std::string_view name_;
  Hidden hidden_;
  std::size_t words_;
  const std::uint64_t* any_;
  const std::uint64_t* stars_;
  const std::uint64_t* first_;
  bool at_token_ = false;  // one begins here
  bool somewhere_ = false;
  std::array<std::uint64_t, kWordsMax> at_;  // only the first `words_` are used
};

PatternSet::Members PatternSet::matching(std::string_view name, Hidden hidden) const {
  return Reader(*this, name, hidden).read();
}

Result<Pattern> Pattern::parse(std::string_view text) {
  if (const char* expected = fault_of(text)) {
    return Error{CloseCode::kMalformed, "\"" + std::string(text.substr(0, kNameBytesMax)) +
                                            "\" is not a name pattern: expected " + expected};
  }
  return Pattern{text};
}

Pattern::Pattern(std::string_view text) : text_(text) {
  if (has_wildcard(text))
    compiled_ = std::make_shared<const PatternSet>(std::vector<std::string_view>{text});
}

bool is_pattern(std::string_view text) {
  return fault_of(text) == nullptr;
}

bool is_canonical_name(std::string_view name) {
  return !has_wildcard(name) && is_pattern(name);
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
