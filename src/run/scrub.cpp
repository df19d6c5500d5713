#include "run/scrub.hpp"

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

// What was hidden before is part of its word.
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

// What begins here and is to go: from where to where; nullopt: nothing.
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

// Three parts with dots, as a JWT has it: the first is a JSON object in base64.
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

// Of an address what is before its host, and behind its path. What is before a host may contain
// any sign, and the last @ before a slash ends it.
void scrub_address(std::string& text, std::size_t& at) {
  std::size_t end = word_end(text, at);
  const std::size_t host_end = std::min(text.find('/', at), end);
  if (const auto user = std::string_view(text).substr(0, host_end).rfind('@');
      user != std::string::npos && user >= at) {
    text.replace(at, user - at, kGone);
    end = word_end(text, at);
  }
  if (const auto more = text.find_first_of("?#", at); more < end) {
    text.replace(more + 1, end - more - 1, kGone);
    end = more + 1 + kGone.size();
  }
  at = end;
}

std::optional<Span> secret_at(std::string_view text, std::size_t at) {
  for (const std::string_view mark : {"Bearer ", "Basic ", "CONNECT_BRIDGE_TOKEN=", "auth.token:=",
                                      "auth.plugin_options:=", "http_proxy_login:="})
    if (auto found = word_behind(text, at, mark)) return found;
  if (auto found = pem_at(text, at)) return found;
  return jwt_at(text, at);
}

}  // namespace

void Scrubber::learn(std::string_view secret) {
  if (secret.size() < kLeast) return;
  known_.emplace_back(secret);
  std::stable_sort(known_.begin(), known_.end(),
                   [](const auto& a, const auto& b) { return a.size() > b.size(); });
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

void Scrubber::learn(const ParameterMap& parameters) {
  for (const auto& [key, value] : parameters) {
    const auto* text = std::get_if<std::string>(&value);
    const KeySpec* spec = find_key(key);
    if (text == nullptr) continue;
    learn_address(*text);
    if (spec != nullptr && !spec->secret) continue;
    learn(*text);
    if (const auto colon = text->find(':'); spec != nullptr && colon != std::string::npos)
      learn(std::string_view(*text).substr(colon + 1));
  }
}

std::string Scrubber::scrubbed(std::string_view given) const {
  std::string text{given};
  for (const auto& secret : known_)
    for (auto at = text.find(secret); at != std::string::npos;
         at = text.find(secret, at + kGone.size()))
      text.replace(at, secret.size(), kGone);
  for (std::size_t at = 0; at < text.size();) {
    if (begins(text, at, "://")) {
      at += 3;
      scrub_address(text, at);
    } else if (const auto span = secret_at(text, at)) {
      text.replace(span->from, span->to - span->from, kGone);
      at = span->from + kGone.size();
    } else {
      ++at;
    }
  }
  return text;
}

std::string parameters_to_show(const ParameterMap& parameters) {
  std::string text;
  for (const auto& [key, value] : parameters)
    text += key + ": " + (is_ros_key(key) ? to_text(value) : shown_to_others(key, value)) + "\n";
  return text;
}

}  // namespace connect_bridge
