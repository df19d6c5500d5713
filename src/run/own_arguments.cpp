#include "run/own_arguments.hpp"

#include <algorithm>
#include <cstring>
#include <istream>
#include <string_view>

#include "access/login/secret.hpp"
#include "config/invitation.hpp"
#include "config/key_search.hpp"

namespace connect_bridge {
namespace {

constexpr std::size_t kLineBytesMax = 4096;

// The place of a secret key's value, also behind a typing error: KEY=VALUE, KEY:VALUE, "KEY VALUE".
std::size_t secret_in(std::string_view argument) {
  for (const std::string& given : secret_arguments()) {
    const std::string_view key = std::string_view(given).substr(0, given.find(":="));
    for (auto at = argument.find(key); at != std::string_view::npos;
         at = argument.find(key, at + 1)) {
      const auto behind = at + key.size();
      const auto value = argument.find_first_not_of(":= \t", behind);
      if (value != behind && value != std::string_view::npos) return value;
    }
  }
  return std::string_view::npos;
}

void hide(char* word) {
  const std::string_view argument(word);
  const auto hide_from = [&](std::size_t at) { std::memset(word + at, 'x', argument.size() - at); };
  if (const auto at = secret_in(argument); at != std::string_view::npos) return hide_from(at);
  const auto code = argument.find('#');
  const bool has_code =
      argument.starts_with(kInvitationScheme) || argument.starts_with(kRelayLineScheme);
  if (has_code && code != std::string_view::npos) hide_from(code + 1);
}

}  // namespace

OwnArguments::OwnArguments(int argc, char** argv) : texts_(argv, argv + argc) {
  for (int i = 1; i < argc; ++i) hide(argv[i]);
  point();
}

void OwnArguments::point() {
  words_.clear();
  for (std::string& text : texts_) words_.push_back(text.data());
  words_.push_back(nullptr);
}

std::string OwnArguments::read_from(std::istream& in) {
  const auto end = std::find(texts_.begin(), texts_.end(), "--ros-args");
  const auto word = std::find(texts_.begin(), end, "-");
  if (word == end) return {};
  std::string line(kLineBytesMax, '\0');
  in.getline(line.data(), static_cast<std::streamsize>(line.size()));
  const std::string_view text = trim(line.c_str());
  if (!text.starts_with(kInvitationScheme) && !text.starts_with(kRelayLineScheme))
    return "-: expected an invitation (wss+pair://...) or the line of a relay (wss+relay://...) on "
           "the standard input";
  *word = text;
  wipe(line);
  point();
  return {};
}

}  // namespace connect_bridge
