#include "ros/rcl/shared_memory.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <string>

namespace connect_bridge::ros {
namespace {

TEST(SharedMemory, OfAnotherUserIsAProblem) {
  EXPECT_EQ(problem_of_users({{"fastdds_port7411", 1000}, {"fastdds_port7413", 0}}, 1000, 0),
            "Fast DDS's shared memory here has files of another user (/dev/shm/fastdds_port7413 is "
            "of the user id 0): messages of nodes that run as that user may not arrive; run this "
            "as their user, or with FASTDDS_BUILTIN_TRANSPORTS=UDPv4 (it has no effect with "
            "ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST)");
  EXPECT_NE(problem_of_users({{"fastrtps_port7411", 1000}}, 0, 0), "") << "before Kilted";
  EXPECT_NE(problem_of_users({{"fastdds_port17911_el", 1000}}, 0, 42), "");
}

TEST(SharedMemory, OfTheSameUserOrOfOthersThanFastDdsIsNone) {
  EXPECT_EQ(problem_of_users({}, 0, 0), "");
  EXPECT_EQ(problem_of_users({{"fastdds_port7411", 1000}}, 1000, 0), "");
  EXPECT_EQ(problem_of_users({{"sem.other", 1000}, {"my_fastdds_port7411", 1000}}, 0, 0), "");
  // Of another domain, or without one.
  for (const char* name : {"fastdds_port7399", "fastdds_port7650", "fastdds_0123", "fastdds_port"})
    EXPECT_EQ(problem_of_users({{name, 1000}}, 0, 0), "") << name;
}

TEST(SharedMemory, FilesThatEverybodyMayWriteAreNotListed) {
  std::string path = "/dev/shm/connect_bridge_test_XXXXXX";
  const int file = mkstemp(path.data());
  if (file < 0) GTEST_SKIP() << "/dev/shm cannot be written";
  const auto is_listed = [&] {
    const auto files = shared_files();
    return std::any_of(files.begin(), files.end(), [&](const SharedFile& one) {
      return "/dev/shm/" + one.name == path && one.owner == geteuid();
    });
  };
  EXPECT_TRUE(is_listed());
  EXPECT_EQ(fchmod(file, 0666), 0);
  EXPECT_FALSE(is_listed());
  close(file);
  unlink(path.c_str());
}

}  // namespace
}  // namespace connect_bridge::ros
