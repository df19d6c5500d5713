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

TEST(MissingMiddleware, IsToldWithWhatIsInstalled) {
  EXPECT_EQ(
      to_text(MissingMiddleware{"RMW_IMPLEMENTATION", "rmw_x_cpp", {"rmw_a_cpp", "rmw_b_cpp"}}),
      "RMW_IMPLEMENTATION=rmw_x_cpp; installed: rmw_a_cpp, rmw_b_cpp");
  EXPECT_EQ(to_text(MissingMiddleware{"RMW_IMPLEMENTATION", "rmw_x_cpp", {}}),
            "RMW_IMPLEMENTATION=rmw_x_cpp");
}

}  // namespace
}  // namespace connect_bridge::ros
