#include "access/login/runtime_folder.hpp"

#include <gmock/gmock.h>

#include <filesystem>

#include "unit/scratch.hpp"

namespace connect_bridge {
namespace {

namespace fs = std::filesystem;
using testing::UnorderedElementsAre;

// A unit's folder has the unit's name, which the operator chooses.
TEST(RuntimeFolder, FoldersOfUnitsHaveAnyName) {
  const std::string run = test::scratch_folder() + "run";
  for (const char* name : {"connect_bridge", "connect_client", "of_anna", "lock"})
    fs::create_directories(run + "/" + name);
  fs::permissions(run + "/lock", fs::perms::all | fs::perms::sticky_bit);
  fs::create_directory_symlink(run + "/lock", run + "/linked");
  EXPECT_THAT(
      folders_of_units(run),
      UnorderedElementsAre(run + "/connect_bridge", run + "/connect_client", run + "/of_anna"))
      << "others may put a socket into /run/lock";
}

}  // namespace
}  // namespace connect_bridge
