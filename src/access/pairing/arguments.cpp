#include "access/pairing/arguments.hpp"

#include <algorithm>

#include "config/invitation.hpp"
#include "config/key_search.hpp"

namespace connect_bridge {
namespace {

constexpr char kPair[] = "--pair";
constexpr char kDrive[] = "--drive";
constexpr char kRobot[] = "--robot";
constexpr char kOperate[] = "--operate";
constexpr char kVia[] = "--via";

// The argument that the user may have meant; empty: none is similar.
std::string meant(const std::string& word, const std::string& shown, Role role) {
  if (word.find(":=") != std::string::npos) return "--ros-args -p " + shown + ":=...";
  if (word.ends_with(".yaml") || word.ends_with(".yml")) return "--ros-args --params-file " + shown;
  if (role == Role::kClient && (word.starts_with("ws://") || word.starts_with("wss://")))
    return "--ros-args -p url:=" + shown;
  constexpr std::size_t kTypingErrors = 2;
  std::string best;
  std::size_t least = kTypingErrors + 1;
  for (const char* option : {kPair, kDrive, kRobot, kOperate, kVia, "--help", "--version"}) {
    const bool is_of_server = option == kPair || option == kDrive || option == kVia;
    if ((is_of_server && role != Role::kServer) || (option == kRobot && role != Role::kClient))
      continue;
    const std::size_t distance = edit_distance(word, option);
    if (distance >= least) continue;
    least = distance;
    best = option;
  }
  return best;
}

std::string unknown(const std::string& word, Role role) {
  const char* const program = role == Role::kServer ? "server" : "client";
  // The text after := may be a token, the text after # a code.
  const std::string shown = word.substr(0, std::min(word.find(":="), word.find('#')));
  const std::string instead = meant(word, shown, role);
  return "unknown argument \"" + shown + "\": " +
         (instead.empty() ? "parameters are given behind --ros-args, see "
                          : "did you mean " + instead + "? See ") +
         program + " --help";
}

// Checks that the arguments fit together.
void check_words(Arguments& read, Role role) {
  const bool client_is_robot = read.robot == Role::kClient;
  const auto add = [&](const char* problem) { read.problems.emplace_back(problem); };
  if (role == Role::kClient) {
    if (client_is_robot && read.invitation.empty())
      add("--robot needs the invitation that 'server --pair --drive' prints; a robot that has "
          "paired starts without arguments");
    if (!read.via.empty())
      add("--via is for the end that listens: a client finds the relay in its invitation");
    if (read.operates && !client_is_robot)
      add("--operate belongs to the robot's end: after 'client --robot' or 'server --pair' there");
    return;
  }
  if (client_is_robot && !read.pairs) add("--drive makes an invitation for a robot: add --pair");
  if (client_is_robot && read.operates)
    add("--operate belongs to the robot's end, and to its owner: after 'client --robot' there");
  if (read.operates && !client_is_robot && !read.pairs)
    add("--operate gives rights to a client that pairs: add --pair");
  if (!read.via.empty() && (!read.pairs || !read.host.empty()))
    add("--via names the relay that clients connect to: give --pair without a host");
}

}  // namespace

Arguments read_arguments(const std::vector<std::string>& words, Role role) {
  Arguments read;
  const bool server = role == Role::kServer;
  bool client_is_robot = false;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    if (server && (word == kPair || word == kDrive)) {
      (word == kPair ? read.pairs : client_is_robot) = true;
      if (i + 1 < words.size() && !words[i + 1].starts_with('-')) read.host = words[++i];
    } else if (!server && word == kRobot) {
      client_is_robot = true;
    } else if (word == kOperate) {
      read.operates = true;
    } else if (word == kVia && i + 1 < words.size()) {
      read.via = words[++i];
    } else if (!server && word.starts_with(kInvitationScheme)) {
      read.invitation = word;
    } else {
      read.problems.push_back(unknown(word, role));
    }
  }
  if (client_is_robot) read.robot = Role::kClient;
  check_words(read, role);
  return read;
}

}  // namespace connect_bridge
