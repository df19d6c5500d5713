#include "unit/source_text.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

namespace connect_bridge::test {

std::string source_text(const std::string& path) {
  std::ifstream file(std::string(CONNECT_SOURCE_DIR) + "/" + path);
  EXPECT_TRUE(file) << path;
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

}  // namespace connect_bridge::test
