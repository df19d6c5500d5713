#include "ros/rcl/fastdds_profile.hpp"

#include <gtest/gtest.h>
#include <rmw/rmw.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace connect_bridge::ros {
namespace {

constexpr const char* kVariables[] = {"FASTDDS_DEFAULT_PROFILES_FILE",
                                      "FASTRTPS_DEFAULT_PROFILES_FILE"};

// The file that Fast DDS would read now; empty: none.
std::string given() {
  std::string path;
  for (const char* variable : kVariables)
    if (const char* value = std::getenv(variable)) path += value;
  return path;
}

class FastDdsProfileTest : public testing::Test {
 protected:
  FastDdsProfileTest() {
    for (const char* variable : kVariables) unsetenv(variable);
  }

  const std::string rmw = rmw_get_implementation_identifier();
};

TEST_F(FastDdsProfileTest, IsThereForAMomentAndNothingStays) {
  if (!rmw.starts_with("rmw_fastrtps")) GTEST_SKIP() << rmw;
  std::string path;
  {
    const FastDdsProfile profile(true);
    path = given();
    std::ifstream file(path);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    EXPECT_NE(text.find("is_default_profile=\"true\""), std::string::npos) << path;
  }
  EXPECT_EQ(given(), "");
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST_F(FastDdsProfileTest, TheUsersProfilesStay) {
  for (const char* variable : kVariables) {
    setenv(variable, "users.xml", 1);
    {
      const FastDdsProfile profile(true);
      EXPECT_EQ(given(), "users.xml");
    }
    EXPECT_EQ(given(), "users.xml");
    unsetenv(variable);
  }
}

TEST_F(FastDdsProfileTest, WhereNoMiddlewareIsLoadedNothingHappens) {
  const FastDdsProfile profile(false);
  EXPECT_EQ(given(), "");
}

}  // namespace
}  // namespace connect_bridge::ros
