// What is said of files of parameters that cannot be used.
#include "ros/parameters/parameter_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "unit/scratch.hpp"

namespace connect_bridge::ros {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(ParameterFile, ThatIsNotThereIsToldSo) {
  const std::string file = test::scratch_folder() + "nowhere.yaml";
  EXPECT_EQ(read_parameter_file(file).problem,
            file + ": cannot be opened: No such file or directory");
}

// Where in its own source the parser found that is nobody's business.
TEST(ParameterFile, ThatIsWrongIsToldInOneLine) {
  const std::string file = test::scratch_folder() + "wrong.yaml";
  std::ofstream(file) << "a: [1\n";
  const std::string problem = read_parameter_file(file).problem;
  EXPECT_THAT(problem, HasSubstr("Error at line 1"));
  EXPECT_THAT(problem, Not(HasSubstr("\n")));
  EXPECT_THAT(problem, Not(HasSubstr(".c:")));
}

}  // namespace
}  // namespace connect_bridge::ros
