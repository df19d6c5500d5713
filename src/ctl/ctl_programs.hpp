// Running servers and clients of this machine, and the files that they were given.
#pragma once

#include <cstddef>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "core/base/parameter.hpp"

// The end of a regular file, from a whole line on; empty for other files: a pipe would block. Files
// of a process in /proc have no size and are read as a whole.
[[nodiscard]] std::string content_of(
    const std::filesystem::path& file,
    std::size_t end_bytes = std::numeric_limits<std::size_t>::max());

// The process behind "FOLDER/connect_server-17.status": 17. 0: the name has another form, or the
// process is another user's than the socket, who could have named any process.
[[nodiscard]] int process_of(const std::filesystem::path& socket);

// One running program, as /proc shows it to its user.
struct Program {
  std::string socket;
  int process = 0;
  std::string node;                // "/robot1/connect_server"
  std::filesystem::path folder;    // working folder of the program: its relative names begin there
  std::vector<std::string> words;  // its command line

  explicit Program(const std::string& where);
  // Names of parameter files, as they were given.
  [[nodiscard]] std::vector<std::string> parameter_files() const;
  // Parameters behind -p, as texts.
  [[nodiscard]] connect_bridge::ParameterMap parameters() const;
  // The command line without values of secret parameters.
  [[nodiscard]] std::string command_line() const;
};
