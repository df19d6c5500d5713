#include "ctl/scrub.hpp"

#include <algorithm>
#include <cctype>
#include <optional>

#include "config/checked_values.hpp"
#include "config/key_search.hpp"

namespace connect_bridge {
namespace {

constexpr std::string_view kGone = "(hidden)";

using Is = bool (*)(char);

bool ends_word(char c) {
  return std::isspace(static_cast<unsigned char>(c)) != 0 || c == '"' || c == '\'' || c == '<' ||
         c == '>' || c == ',' || c == ')' || c == ']' || c == '}' || c == '`';
}

bool is_of_token(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_';
}

std::size_t skip(std::string_view text, std::size_t from, Is is) {
  while (from < text.size() && is(text[from])) ++from;
  return from;
}

bool begins(std::string_view text, std::size_t at, std::string_view with) {
  return text.substr(at, with.size()) == with;
}

// Text that was hidden before is part of its word.
std::size_t word_end(std::string_view text, std::size_t from) {
  while (from < text.size()) {
    if (begins(text, from, kGone)) {
      from += kGone.size();
    } else if (ends_word(text[from])) {
      break;
    } else {
      ++from;
    }
  }
  return from;
}

// The range of text to hide.
struct Span {
  std::size_t from = 0;
  std::size_t to = 0;
};

std::optional<Span> pem_at(std::string_view text, std::size_t at) {
  constexpr std::string_view kBegin = "-----BEGIN ";
  constexpr std::string_view kEnd = "-----END ";
  constexpr std::string_view kLast = "-----";
  if (!begins(text, at, kBegin)) return std::nullopt;
  const std::size_t line = text.find('\n', at);
  if (text.substr(at, line - at).find("PRIVATE") == std::string_view::npos) return std::nullopt;
  const std::size_t end = text.find(kEnd, at);
  const std::size_t last =
      end == std::string_view::npos ? end : text.find(kLast, end + kEnd.size());
  return Span{at, last == std::string_view::npos ? text.size() : last + kLast.size()};
}

// A token of three parts with dots, as a JWT: the first part is a JSON object in base64.
std::optional<Span> jwt_at(std::string_view text, std::size_t at) {
  if (!begins(text, at, "eyJ")) return std::nullopt;
  const std::size_t first = skip(text, at, is_of_token);
  if (first >= text.size() || text[first] != '.') return std::nullopt;
  std::size_t end = skip(text, first + 1, is_of_token);
  if (end < text.size() && text[end] == '.') end = skip(text, end + 1, is_of_token);
  return Span{at, end};
}

std::optional<Span> word_behind(std::string_view text, std::size_t at, std::string_view mark) {
  if (!begins(text, at, mark)) return std::nullopt;
  return Span{at + mark.size(), word_end(text, at + mark.size())};
}

// The beginning of an address's host, for `at` behind its "://". The user before the host may
// contain any sign but those that no address has; the last @ before a slash ends it.
std::size_t host_of(std::string_view text, std::size_t at) {
  constexpr std::string_view kNeverInOne = "/\"'<>`";
  std::size_t host = at;
  for (; at < text.size() && std::isspace(static_cast<unsigned char>(text[at])) == 0 &&
         kNeverInOne.find(text[at]) == std::string_view::npos;
       ++at)
    if (text[at] == '@') host = at + 1;
  return host;
}

std::optional<Span> secret_at(std::string_view text, std::size_t at) {
  for (const std::string_view mark : {"Bearer ", "Basic ", "CONNECT_BRIDGE_TOKEN="})
    if (auto found = word_behind(text, at, mark)) return found;
  for (const std::string& mark : secret_arguments())
    if (auto found = word_behind(text, at, mark)) return found;
  if (auto found = pem_at(text, at)) return found;
  return jwt_at(text, at);
}

// Copies a text and hides spans in it, which come in their order.
class Copy {
 public:
  explicit Copy(std::string_view text) : text_(text) {}

  void without(const Span& span) {
    made_.append(text_.substr(at_, span.from - at_)).append(kGone);
    at_ = span.to;
  }
  [[nodiscard]] std::string take() {
    made_.append(text_.substr(at_));
    return std::move(made_);
  }

 private:
  std::string_view text_;
  std::string made_;
  std::size_t at_ = 0;
};

// Hides the user of an address, and its query or fragment. Returns the place where the address
// ends.
std::size_t scrub_address(std::string_view text, std::size_t at, Copy& copy) {
  const std::size_t host = host_of(text, at);
  if (host > at) copy.without({at, host - 1});
  const std::size_t end = word_end(text, host);
  const std::size_t more = text.substr(0, end).find_first_of("?#", host);
  if (more != std::string_view::npos) copy.without({more + 1, end});
  return end;
}

}  // namespace

bool Scrubber::LongestFirst::operator()(const std::string& a, const std::string& b) const {
  return a.size() != b.size() ? a.size() > b.size() : a < b;
}

void Scrubber::learn(std::string_view secret) {
  if (secret.size() >= kLeast) known_.emplace(secret);
}

void Scrubber::learn_address(std::string_view address) {
  const std::size_t from = address.find("://");
  if (from == std::string_view::npos) return;
  const std::size_t host_end = std::min(address.find('/', from + 3), address.size());
  const std::size_t user_end = address.substr(0, host_end).rfind('@');
  const std::size_t password = address.find(':', from + 3);
  if (user_end != std::string_view::npos && password < user_end)
    learn(address.substr(password + 1, user_end - password - 1));
  const std::size_t query = address.find_first_of("?#", from);
  for (std::size_t at = query; at < address.size();) {
    const std::size_t end = std::min(address.find_first_of("?#&=", at + 1), address.size());
    learn(address.substr(at + 1, end - at - 1));
    at = end;
  }
}

// Options of a plugin are "user=anna password=...", and a log may have one of them alone.
void Scrubber::learn_words(std::string_view secret) {
  constexpr std::string_view kBetween = " \t\r\n=:,;&\"'";
  for (std::size_t at = 0; at < secret.size();) {
    const std::size_t end = std::min(secret.find_first_of(kBetween, at), secret.size());
    learn(secret.substr(at, end - at));
    at = end + 1;
  }
}

void Scrubber::learn(const ParameterMap& parameters) {
  for (const auto& [key, value] : parameters) {
    const auto* text = std::get_if<std::string>(&value);
    const KeySpec* spec = find_key(key);
    if (text == nullptr || is_ros_key(key)) continue;
    learn_address(*text);
    if (spec != nullptr && !spec->secret) continue;
    learn(*text);
    learn_words(*text);
    if (const auto colon = text->find(':'); spec != nullptr && colon != std::string::npos)
      learn(std::string_view(*text).substr(colon + 1));
  }
}

std::string Scrubber::scrubbed(std::string_view given) const {
  std::string text{given};
  for (const auto& secret : known_) {
    Copy copy(text);
    std::size_t at = text.find(secret);
    if (at == std::string::npos) continue;
    for (; at != std::string::npos; at = text.find(secret, at + secret.size()))
      copy.without({at, at + secret.size()});
    text = copy.take();
  }
  Copy copy(text);
  for (std::size_t at = 0; at < text.size();) {
    if (begins(text, at, "://")) {
      at = scrub_address(text, at + 3, copy);
    } else if (const auto span = secret_at(text, at)) {
      copy.without(*span);
      at = span->to;
    } else {
      ++at;
    }
  }
  return copy.take();
}

std::string parameters_to_show(const ParameterMap& parameters) {
  std::string text;
  for (const auto& [key, value] : parameters)
    text += key + ": " + (is_ros_key(key) ? to_text(value) : shown_to_others(key, value)) + "\n";
  return text;
}

}  // namespace connect_bridge
