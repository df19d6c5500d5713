#include "ros/rcl/fastdds_profile.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rmw/rmw.h>
#include <sys/resource.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace connect_bridge::ros {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

constexpr const char* kVariables[] = {"FASTDDS_DEFAULT_PROFILES_FILE",
                                      "FASTRTPS_DEFAULT_PROFILES_FILE"};

constexpr const char* kTransports = "FASTDDS_BUILTIN_TRANSPORTS";

// The file that Fast DDS would read now; empty: none.
std::string given() {
  std::string path;
  for (const char* variable : kVariables)
    if (const char* value = std::getenv(variable)) path += value;
  return path;
}

std::string text_given() {
  std::ifstream file(given());
  return {std::istreambuf_iterator<char>(file), {}};
}

class FastDdsProfileTest : public testing::Test {
 protected:
  FastDdsProfileTest() {
    for (const char* variable : kVariables) unsetenv(variable);
    unsetenv(kTransports);
  }

  const std::string rmw = rmw_get_implementation_identifier();
};

TEST_F(FastDdsProfileTest, IsThereForAMomentAndNothingStays) {
  if (!rmw.starts_with("rmw_fastrtps")) GTEST_SKIP() << rmw;
  std::string path;
  {
    const FastDdsProfile profile(true, 0);
    path = given();
    EXPECT_NE(text_given().find("is_default_profile=\"true\""), std::string::npos) << path;
    EXPECT_EQ(text_given().find("segment_size"), std::string::npos);
    EXPECT_NE(text_given().find("<leaseAnnouncement>"), std::string::npos);
  }
  EXPECT_EQ(given(), "");
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST_F(FastDdsProfileTest, TheUsersProfilesStay) {
  for (const char* variable : kVariables) {
    setenv(variable, "users.xml", 1);
    {
      const FastDdsProfile profile(true, 0);
      EXPECT_EQ(given(), "users.xml");
    }
    EXPECT_EQ(given(), "users.xml");
    unsetenv(variable);
  }
}

TEST_F(FastDdsProfileTest, ThereIsMoreSharedMemoryWhereThatIsWantedAndThere) {
  if (!rmw.starts_with("rmw_fastrtps")) GTEST_SKIP() << rmw;
  const auto segment_is_given = [](std::size_t bytes) {
    const FastDdsProfile profile(true, bytes);
    EXPECT_NE(text_given().find("heartbeat"), std::string::npos);
    return text_given().find("<segment_size>" + std::to_string(bytes)) != std::string::npos;
  };
  EXPECT_TRUE(segment_is_given(1 << 20));
  EXPECT_FALSE(segment_is_given(std::size_t{1} << 60));  // more than any memory
  setenv(kTransports, "UDPv4", 1);
  EXPECT_FALSE(segment_is_given(1 << 20));
  unsetenv(kTransports);
}

TEST_F(FastDdsProfileTest, WithoutAFolderForTemporaryFilesThereIsAnother) {
  if (!rmw.starts_with("rmw_fastrtps")) GTEST_SKIP() << rmw;
  const char* const before = std::getenv("TMPDIR");
  const std::string old = before ? before : "";
  for (const char* folder : {"/nonexistent", "/proc"}) {  // the latter is one, but for nobody
    setenv("TMPDIR", folder, 1);
    const FastDdsProfile profile(true, 0);
    EXPECT_NE(text_given().find("heartbeat"), std::string::npos) << folder;
    EXPECT_THAT(profile.problems(), Not(Contains(HasSubstr("cannot write")))) << folder;
  }
  unsetenv("TMPDIR");
  if (before) setenv("TMPDIR", old.c_str(), 1);
}

TEST_F(FastDdsProfileTest, ThatNoFileCanBeWrittenIsSaid) {
  if (!rmw.starts_with("rmw_fastrtps")) GTEST_SKIP() << rmw;
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  const rlimit none{0, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
  const FastDdsProfile profile(true, 0);
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
  EXPECT_EQ(given(), "");
  EXPECT_THAT(profile.problems(), ElementsAre(AllOf(HasSubstr("cannot write a file with settings"),
                                                    HasSubstr("/dev/shm: Too many open files"))));
}

TEST_F(FastDdsProfileTest, WhereNoMiddlewareIsLoadedNothingHappens) {
  const FastDdsProfile profile(false, 0);
  EXPECT_EQ(given(), "");
}

}  // namespace
}  // namespace connect_bridge::ros
