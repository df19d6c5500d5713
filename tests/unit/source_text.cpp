#include "unit/source_text.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

namespace connect_bridge::test {

std::string source_path(const std::string& path) {
  return std::string(CONNECT_SOURCE_DIR) + "/" + path;
}

std::string source_text(const std::string& path) {
  std::ifstream file(source_path(path));
  EXPECT_TRUE(file) << path;
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

}  // namespace connect_bridge::test
