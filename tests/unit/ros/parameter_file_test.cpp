// What is said of files of parameters that cannot be used.
#include "ros/parameters/parameter_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "unit/scratch.hpp"

namespace connect_bridge::ros {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ContainsRegex;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;

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

std::vector<std::string> problems_of(const std::string& text) {
  return read_parameter_file(file_with(text)).problems;
}

// rcl says "Sequence should be of same type. Value type 'integer' do not belong at line_num 3".
TEST(ParameterFile, AListOfSeveralKindsIsNamed) {
  EXPECT_THAT(
      problems_of("/**:\n"
                  "  ros__parameters:\n"
                  "    rule.look.export_topics: [/scan, 1]\n"
                  "    b: [1, 2.5]\n"
                  "    c: ['1', one, \"2.5\"]\n"
                  "    d: [.inf, -1e3, .5]\n"
                  "    e: [on, yes, off]\n"
                  "    f: [a, [b]]\n"),
      ElementsAre(HasSubstr(":3: \"rule.look.export_topics\" is a list of text with whole "
                            "numbers in it (1): write all alike, text in quotes"),
                  HasSubstr(":4: \"b\" is a list of whole numbers with numbers with a point "
                            "in it (2.5)"),
                  HasSubstr(":8: \"f\" is a list with another list or a map in it")));
}

TEST(ParameterFile, ATabIsNamed) {
  EXPECT_THAT(problems_of("/**:\n  ros__parameters:\n\trules: []\n"),
              ElementsAre(EndsWith(".yaml:3: a tab; YAML indents with spaces")));
  EXPECT_THAT(problems_of("/**:\n  ros__parameters:\n    listen:\n  \t  port: 1\n"),
              ElementsAre(EndsWith(".yaml:4: a tab; YAML indents with spaces")));
  EXPECT_THAT(problems_of("/**:\n  ros__parameters:\n    a: b\n\t\n"),
              ElementsAre(EndsWith(".yaml:4: a tab; YAML indents with spaces")));
  EXPECT_THAT(problems_of("/**:\n  ros__parameters:\n    a: b\tc\n"), IsEmpty());
}

TEST(ParameterFile, AWrongIndentIsNamed) {
  EXPECT_THAT(problems_of("/**:\n  ros__parameters:\n    listen:\n      port: 1\n   rules: []\n"),
              ElementsAre(AllOf(ContainsRegex(".yaml:5:[0-9]+: "),
                                HasSubstr("keys of one map stand in one column"))));
  EXPECT_THAT(problems_of("/**:\n  ros__parameters:\n  dead_after: 3.0\n"),
              ElementsAre(HasSubstr(":2: \"ros__parameters\" has nothing below it: indent the "
                                    "parameters further")));
  EXPECT_THAT(problems_of("/**:\nros__parameters:\n  dead_after: 3.0\n"),
              Contains(HasSubstr(":2: \"ros__parameters\" stands below a node's name: indent it")));
}

TEST(ParameterFile, AParameterOutsideOfTheSectionIsNamed) {
  EXPECT_THAT(problems_of("/**:\n  ros__parameters:\n    rules: [a]\n  rule:\n    a:\n"
                          "      export_topics: [/a]\n"),
              Contains(HasSubstr(":6: \"export_topics\" is no node's name: indent it below "
                                 "`ros__parameters:`")));
}

TEST(ParameterFile, AFileOfBareParametersIsToldWhatIsMissing) {
  for (const char* bare : {"rules: []\ndead_after: 3.0\n", "/**:\n  dead_after: 3.0\n", "[a]\n",
                           "listen: {port: 1}\n"})
    EXPECT_THAT(
        problems_of(bare),
        Contains(HasSubstr(":1: expected `/**:` and below it, indented, `ros__parameters:`")))
        << bare;
}

TEST(ParameterFile, ThatIsNoYamlIsToldWithLineAndColumn) {
  const std::string file = file_with("/**:\n  ros__parameters: {a: 1\n");
  EXPECT_THAT(read_parameter_file(file).problems,
              ElementsAre(ContainsRegex("params.yaml:[0-9]+:[0-9]+: .")));
}

// In our words, at the line that is wrong: yaml-cpp finds it later, and names no cure.
TEST(ParameterFile, UsualMistakesHaveTheirCures) {
  const std::string head = "/**:\n  ros__parameters:\n";
  const auto first = [&](const std::string& lines) {
    const auto problems = problems_of(head + lines);
    return problems.empty() ? std::string("none") : problems.front();
  };
  const std::string blank = "a blank is missing behind the colon: `";
  EXPECT_NE(first("    url: \"abc\\"), "none");  // it ends within an escape
  EXPECT_THAT(first("    auth.method:none\n"), HasSubstr(":3: " + blank + "auth.method: ...`"));
  EXPECT_THAT(first("    auth.method:none\n    rules: [a]\n"),
              HasSubstr(":3: " + blank + "auth.method: ...`"));
  EXPECT_THAT(first("    listen: {port:1}\n"), HasSubstr(":3: " + blank + "port: ...`"));
  EXPECT_THAT(first("    rule.a.export_topics: [*, /x]\n"),
              HasSubstr("a text that begins with * stands in quotation marks"));
  EXPECT_THAT(first("    rule.a.export_topics: [*/x]\n"),
              HasSubstr("a text that begins with * stands in quotation marks"));
  for (const char* value : {"@a", "%s"})
    EXPECT_THAT(first(std::string("    prefix: ") + value + "\n"),
                HasSubstr("a text that begins with @, % or ` stands in quotation marks"));
  EXPECT_THAT(first("    rules: [a\n    rule.a.export_topics: [/x]\n"),
              ContainsRegex(":3:[0-9]+: a . that is not closed"));
  EXPECT_THAT(first("    rule: {a: {export_topics: [/x}}\n"),
              ContainsRegex(":3:[0-9]+: a . that is not closed"));
  EXPECT_THAT(first("    url: \"wss://robot\n    prefix: \"/a\"\n"),
              ContainsRegex(":3:[0-9]+: a . that is not closed"));
  EXPECT_THAT(first("    url: 'wss://robot\n    dead_after: 3.0\n"),
              ContainsRegex(":3:10: a ' that is not closed"));
  EXPECT_THAT(first("    dead_after: 3.0\n      prefix: /a\n"),
              HasSubstr("this line is indented further than the key before it"));
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

// rcl joins both into the first one, so that the order of the sections would be another.
TEST(ParameterFile, ANodeInTwoSpellingsIsThereTwice) {
  const std::string file = file_with(
      "/a: {connect_server: {ros__parameters: {x: 1}}}\n"
      "/**: {ros__parameters: {x: 2}}\n"
      "/a/connect_server: {ros__parameters: {x: 3}}\n");
  EXPECT_THAT(read_parameter_file(file).problems,
              ElementsAre(file + ":3: \"/a/connect_server\" is given twice, first in line 1"));
  const std::string slash = file_with(
      "/: {connect_server: {ros__parameters: {x: 1}}}\n"
      "/connect_server: {ros__parameters: {x: 3}}\n");
  EXPECT_THAT(read_parameter_file(slash).problems,
              ElementsAre(HasSubstr("\"/connect_server\" is given twice, first in line 1")));
}

// Names of nodes are joined with '/', so this is no repetition; rcl refuses the name.
TEST(ParameterFile, ANodesNameWithAPointIsItsOwn) {
  EXPECT_THAT(problems_of("a: {b: {ros__parameters: {x: 1}}}\n"
                          "a.b: {ros__parameters: {x: 1}}\n"),
              ElementsAre(HasSubstr("must not contain characters other than alphanumerics")));
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
