// `ctl check FILE`: what a side would do with a parameter file, without starting it.
#pragma once

#include <cstdio>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/explain_right.hpp"
#include "core/base/parameter.hpp"
#include "core/ports/failure.hpp"

namespace connect_bridge {

// Prints lines: text, whatever somebody else's file has put there.
void say(std::FILE* to, std::string_view lines);

// The part of a parameter file for one of our nodes.
struct OfNode {
  Role role = Role::kServer;
  std::string node;      // full name; empty: the file cannot be read, and the rest is not known
  std::string taken_as;  // a line for people: the role, and why this one
  ParameterMap parameters;
  std::vector<Failure> problems;
};
// `role`: as for check_file().
[[nodiscard]] OfNode read_for_node(const std::string& file, const std::string& role);

// The meaning of a parameter file for one of our programs, and all that is wrong with it.
struct FileJudged {
  OfNode given;                   // its problems are also those that only this machine shows
  std::optional<Config> config;   // present exactly if the parameters are valid
  std::vector<Failure> warnings;  // it starts, and lacks something or should be known
  std::vector<Failure> hints;
  std::string not_loaded;  // a key, of what is not executed or asked here; empty: none
};
// Executes no login plugin and sends nothing. `role`: as for check_file().
[[nodiscard]] FileJudged judge_file(const std::string& file, const std::string& role);

// Prints as what it was checked, all problems, also those that only this machine shows, and, if
// possible, what each rule allows to whom. Executes no login plugin and sends nothing. `role`:
// "server", "client", or empty: found from the file. Exit code: 0 in order, 2 not. A certificate
// that has ended is not in order here, although a program starts with it.
int check_file(const std::string& file, const std::string& role);

// `ctl explain`: prints why the file's rules allow an interface or not. An identity without groups
// gets those that the file's auth.token_file gives it. Exit code: 0 if it is allowed, of two
// directions in one at least; 1 if not; 2 if the question or the file is wrong, which is printed to
// standard error.
int explain_file(const std::string& file, const std::string& asked_role,
                 const RightQuestion& question);

}  // namespace connect_bridge
