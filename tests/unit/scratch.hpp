// Files of a test. Tests run as many processes at once, so that a fixed name would be shared.
#pragma once

#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>

namespace connect_bridge::test {

// This process's own folder, with a slash at its end; it goes when the process ends.
inline const std::string& scratch_folder() {
  struct Folder {
    Folder() {
      if (::mkdtemp(path.data()) == nullptr) throw std::runtime_error("cannot make " + path);
      path += '/';
    }
    ~Folder() {
      std::error_code ignored;
      std::filesystem::remove_all(path, ignored);
    }
    std::string path = testing::TempDir() + "connect_bridge_XXXXXX";
  };
  static const Folder folder;
  return folder.path;
}

inline std::string content(const std::string& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace connect_bridge::test
