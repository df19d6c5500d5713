// What is said of files of parameters that cannot be used.
#include "ros/parameters/parameter_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "unit/scratch.hpp"

namespace connect_bridge::ros {
namespace {

using testing::ContainsRegex;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

std::string file_with(const std::string& text) {
  const std::string file = test::scratch_folder() + "params.yaml";
  std::ofstream(file) << text;
  return file;
}

TEST(ParameterFile, ThatIsNotThereIsToldSo) {
  const std::string file = test::scratch_folder() + "nowhere.yaml";
  EXPECT_EQ(read_parameter_file(file).problem(),
            file + ": cannot be opened: No such file or directory");
}

// Where in its own source the parser found that is nobody's business.
TEST(ParameterFile, ThatIsWrongIsToldInOneLine) {
  // Of this file rcl's own parser is the first to complain: it is YAML.
  const std::string problem =
      read_parameter_file(file_with("/**: {ros__parameters: {a: [1, b]}}\n")).problem();
  EXPECT_THAT(problem, HasSubstr("params.yaml: "));
  EXPECT_THAT(problem, Not(HasSubstr("\n")));
  EXPECT_THAT(problem, Not(HasSubstr(".c:")));
}

TEST(ParameterFile, ThatIsNoYamlIsToldWithLineAndColumn) {
  const std::string file = file_with("/**:\n  ros__parameters: {a: 1\n");
  EXPECT_THAT(read_parameter_file(file).problems,
              ElementsAre(ContainsRegex("params.yaml:[0-9]+:[0-9]+: .")));
}

// As by a list without its brackets.
TEST(ParameterFile, AKeyWithoutAValueIsNamed) {
  const std::string file = file_with(
      "/**:\n"
      "  ros__parameters:\n"
      "    rules:\n"
      "    rule.a.export_topics: {/a, /b}\n");
  const std::string cure = " has no value; a list stands in brackets: [/one, /two]";
  EXPECT_THAT(read_parameter_file(file).problems,
              ElementsAre(file + ":3: \"rules\"" + cure, file + ":4: \"/a\"" + cure,
                          file + ":4: \"/b\"" + cure));
  // rcl takes the word for a text.
  EXPECT_THAT(read_parameter_file(file_with("/**: {ros__parameters: {a: ~}}\n")).problems,
              IsEmpty());
}

// rcl takes the last of them, so that a rule could lose what narrows it.
TEST(ParameterFile, ThatGivesAKeyTwiceIsRefused) {
  const std::string file = file_with(
      "/**:\n"
      "  ros__parameters:\n"
      "    dead_after: 3.0\n"
      "    rules: [drive]\n"
      "    rule:\n"
      "      drive: {import_topics: [/cmd_vel], groups: [ops]}\n"
      "      look: {export_topics: [/a]}\n"
      "      drive: {import_topics: [/cmd_vel]}\n"
      "    dead_after: 4.0\n");
  // That `import_topics` is there again goes without saying.
  EXPECT_THAT(read_parameter_file(file).problems,
              ElementsAre(file + ":8: \"drive\" is given twice, first in line 6",
                          file + ":9: \"dead_after\" is given twice, first in line 3"));
  EXPECT_THAT(read_parameter_file(file).problem(), HasSubstr("\"drive\" is given twice"));
  EXPECT_THAT(read_parameter_file(file).sections, IsEmpty());
}

TEST(ParameterFile, TheWholeNameOfAKeyCounts) {
  const std::string file = file_with(
      "/**:\n"
      "  ros__parameters:\n"
      "    listen.port: 1\n"
      "    listen: {port: 2}\n");
  EXPECT_THAT(read_parameter_file(file).problems,
              ElementsAre(file + ":4: \"port\" is given twice, first in line 3"));
}

TEST(ParameterFile, TheSameKeyInOtherPlacesIsNotTwice) {
  const std::string file = file_with(
      "/**:\n"
      "  ros__parameters:\n"
      "    rules: [a, b, a]\n"
      "    rule: {a: {priority: high}, b: {priority: high}}\n"
      "    rule.c.priority: high\n"
      "    rule.c.export_topics: [/a, /b]\n"
      "connect_server: {ros__parameters: {rules: [a]}}\n");
  EXPECT_THAT(read_parameter_file(file).problems, IsEmpty());
}

}  // namespace
}  // namespace connect_bridge::ros
