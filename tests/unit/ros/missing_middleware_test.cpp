// Which RMWs are installed, and what is said of one that is not.
#include "ros/rcl/missing_middleware.hpp"

#include <gmock/gmock.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "unit/scratch.hpp"

namespace connect_bridge::ros {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// Before main(): later another test may have changed it.
const char* const kRmwAtStart = std::getenv("RMW_IMPLEMENTATION");

TEST(MissingMiddleware, ThoseOfAllPrefixesAreFound) {
  const std::string first = test::scratch_folder() + "first";
  const std::string second = test::scratch_folder() + "second";
  const std::string index = "/share/ament_index/resource_index/rmw_typesupport";
  std::filesystem::create_directories(first + index);
  std::filesystem::create_directories(second + index);
  for (const char* name : {"rmw_implementation", "rmw_b_cpp"})
    std::ofstream(first + index + "/" + name) << "";
  for (const char* name : {"rmw_a_cpp", "rmw_b_cpp"})
    std::ofstream(second + index + "/" + name) << "";
  EXPECT_THAT(installed_middlewares(first + ":/nowhere::" + second),
              ElementsAre("rmw_a_cpp", "rmw_b_cpp"));
  EXPECT_THAT(installed_middlewares(""), IsEmpty());
}

// The kernel keeps the environment with which the process began. `ctl` alone hides a part of it.
TEST(MissingMiddleware, IsLookedForWithTheGivenEnvironment) {
  std::ifstream given("/proc/self/environ");
  std::string rmw;
  constexpr std::string_view kName = "RMW_IMPLEMENTATION=";
  for (std::string entry; std::getline(given, entry, '\0');)
    if (entry.starts_with(kName)) rmw = entry.substr(kName.size());
  if (rmw.empty()) GTEST_SKIP() << "the environment names no RMW";
  ASSERT_NE(kRmwAtStart, nullptr);
  EXPECT_EQ(kRmwAtStart, rmw);
}

TEST(MissingMiddleware, IsToldWithWhatIsInstalled) {
  EXPECT_EQ(
      to_text(MissingMiddleware{"RMW_IMPLEMENTATION", "rmw_x_cpp", {"rmw_a_cpp", "rmw_b_cpp"}}),
      "RMW_IMPLEMENTATION=rmw_x_cpp; installed: rmw_a_cpp, rmw_b_cpp");
  EXPECT_EQ(to_text(MissingMiddleware{"RMW_IMPLEMENTATION", "rmw_x_cpp", {}}),
            "RMW_IMPLEMENTATION=rmw_x_cpp");
}

}  // namespace
}  // namespace connect_bridge::ros
