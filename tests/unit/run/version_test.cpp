// The version is told by the programs and by the package: both must name the same.
#include "version.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "unit/source_text.hpp"

namespace connect_bridge {
namespace {

TEST(Version, IsThatOfThePackage) {
  EXPECT_THAT(test::source_text("package.xml"),
              testing::HasSubstr(std::string("<version>") + kProgramVersion + "</version>"));
}

}  // namespace
}  // namespace connect_bridge
