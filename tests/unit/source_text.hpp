// Files of the repository that tests read.
#pragma once

#include <string>

namespace connect_bridge::test {

// The absolute path of what has this path in the repository.
std::string source_path(const std::string& path);

// Content of the file, whose path is relative to the repository. One that cannot be read fails the
// test.
std::string source_text(const std::string& path);

}  // namespace connect_bridge::test
