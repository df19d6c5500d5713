#include "run/arguments.hpp"

#include "config/invitation.hpp"

namespace connect_bridge {
namespace {

constexpr char kPair[] = "--pair";
constexpr char kOperate[] = "--operate";
constexpr char kVia[] = "--via";

std::string unknown(const std::string& word, Role role) {
  const char* const program = role == Role::kServer ? "server" : "client";
  // The text after := may be a token.
  return "unknown argument \"" + word.substr(0, word.find(":=")) +
         "\": parameters are given behind --ros-args, see " + program + " --help";
}

}  // namespace

Arguments read_arguments(const std::vector<std::string>& words, Role role) {
  Arguments read;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    if (role == Role::kServer && word == kPair) {
      read.pairs = true;
      if (i + 1 < words.size() && !words[i + 1].starts_with('-')) read.host = words[++i];
    } else if (role == Role::kServer && word == kOperate) {
      read.operates = true;
    } else if (role == Role::kServer && word == kVia && i + 1 < words.size()) {
      read.via = words[++i];
    } else if (role == Role::kClient && word.starts_with(kInvitationScheme)) {
      read.invitation = word;
    } else {
      read.problems.push_back(unknown(word, role));
    }
  }
  if (read.operates && !read.pairs)
    read.problems.emplace_back("--operate says what a client that pairs may do: give --pair, too");
  if (!read.via.empty() && (!read.pairs || !read.host.empty()))
    read.problems.emplace_back(
        "--via names the relay that clients dial: give --pair without a host");
  return read;
}

}  // namespace connect_bridge
