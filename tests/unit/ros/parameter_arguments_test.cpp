// The last parameter given wins: of all kinds of values, and of all ways in which they are given.
#include "ros/parameters/parameter_arguments.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>
#include <fstream>
#include <iterator>
#include <thread>

#include "unit/scratch.hpp"

namespace connect_bridge::ros {
namespace {

using testing::AllOf;
using testing::ContainsRegex;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr char kNode[] = "/connect_server";

struct Kind {
  const char* yaml;
  ParameterValue value;
};

// Of each kind two, so that the second of one kind is seen to win, too.
const std::vector<Kind>& kinds() {
  static const std::vector<Kind> all = {
      {"true", true},
      {"false", false},
      {"3", std::int64_t{3}},
      {"-4", std::int64_t{-4}},
      {"1.5", 1.5},
      {"2.0", 2.0},
      {"abc", std::string{"abc"}},
      {"\"3\"", std::string{"3"}},
      {"\"\"", std::string{}},
      {"~", std::string{"~"}},  // rcl knows no null
      {"null", std::string{"null"}},
      {"[true, false]", std::vector<bool>{true, false}},
      {"[true]", std::vector<bool>{true}},
      {"[1, 2]", std::vector<std::int64_t>{1, 2}},
      {"[3]", std::vector<std::int64_t>{3}},
      {"[0.5, 1.5]", std::vector<double>{0.5, 1.5}},
      {"[2.5]", std::vector<double>{2.5}},
      {"[a, b]", std::vector<std::string>{"a", "b"}},
      {"[c]", std::vector<std::string>{"c"}},
      {"[]", std::vector<std::string>{}},
  };
  return all;
}

// One parameter for each pair of kinds; `is_second`: with the value of the second.
std::vector<std::pair<std::string, const Kind*>> all_pairs(bool is_second) {
  std::vector<std::pair<std::string, const Kind*>> all;
  for (const Kind& first : kinds())
    for (const Kind& second : kinds())
      all.emplace_back(fmt::format("k{}.k{}", &first - kinds().data(), &second - kinds().data()),
                       is_second ? &second : &first);
  return all;
}

class Command {
 public:
  // `section`: of a file, with the value of each pair.
  void give_file(const std::string& section, bool is_second) {
    std::string text = section + ":\n  ros__parameters:\n";
    for (const auto& [key, kind] : all_pairs(is_second))
      text += "    " + key + ": " + kind->yaml + "\n";
    add("--params-file", write(text));
  }
  void give_arguments(const std::string& word, const std::string& node, bool is_second) {
    for (const auto& [key, kind] : all_pairs(is_second)) add(word, node + key + ":=" + kind->yaml);
  }
  void add(const std::string& word, const std::string& value) {
    words_.push_back(word);
    words_.push_back(value);
  }
  std::string write(const std::string& text) {
    const std::string file = test::scratch_folder() + std::to_string(words_.size()) + ".yaml";
    std::ofstream(file) << text;
    return file;
  }
  ParameterArguments arguments() {
    pointers_.clear();
    for (const auto& word : words_) pointers_.push_back(word.c_str());
    return {static_cast<int>(pointers_.size()), pointers_.data()};
  }
  std::vector<std::string> problems() {
    static_cast<void>(arguments());
    return problems_of_parameters(static_cast<int>(pointers_.size()), pointers_.data());
  }

 private:
  std::vector<std::string> words_ = {"server", "--ros-args"};
  std::vector<const char*> pointers_;
};

struct Way {
  const char* name;
  void (*give)(Command& to, bool is_second);
};

constexpr Way kWays[] = {
    {"a file for any node", [](Command& to, bool second) { to.give_file("/**", second); }},
    {"a file for this node", [](Command& to, bool second) { to.give_file(kNode, second); }},
    {"a file for its name",
     [](Command& to, bool second) { to.give_file("connect_server", second); }},
    {"a file for a namespace", [](Command& to, bool second) { to.give_file("/*", second); }},
    {"-p", [](Command& to, bool second) { to.give_arguments("-p", "", second); }},
    {"--param", [](Command& to, bool second) { to.give_arguments("--param", "", second); }},
    {"-p for this node",
     [](Command& to, bool second) { to.give_arguments("-p", "connect_server:", second); }},
};

TEST(ParameterArguments, TheLastOneGivenWinsOfAllKindsAndWays) {
  for (const Way& first : kWays) {
    for (const Way& second : kWays) {
      Command command;
      first.give(command, false);
      second.give(command, true);
      const auto read = command.arguments().read_for(kNode);
      ASSERT_THAT(read.problems, IsEmpty());
      EXPECT_EQ(read.parameters.size(), kinds().size() * kinds().size());
      for (const auto& [key, kind] : all_pairs(true))
        EXPECT_EQ(read.parameters.at(key), kind->value)
            << key << " by " << first.name << ", then by " << second.name;
    }
  }
}

// A section that stands first in a file is not earlier than the file.
TEST(ParameterArguments, ASectionOfAnEarlierFileIsEarlier) {
  Command command;
  command.add("--params-file", command.write("/**:\n"
                                             "  ros__parameters: {a: 1, b: 1, c: 1}\n"
                                             "connect_server:\n"
                                             "  ros__parameters: {a: 2, b: 2, c: 2}\n"));
  command.add("--params-file", command.write("/**: {ros__parameters: {a: 3.5}}\n"));
  command.add("-p", "b:=text");
  const auto read = command.arguments().read_for(kNode);
  EXPECT_EQ(read.parameters,
            (ParameterMap{{"a", 3.5}, {"b", std::string{"text"}}, {"c", std::int64_t{2}}}));
}

TEST(ParameterArguments, AFileBehindAnArgumentWins) {
  Command command;
  command.add("-p", "a:=1.5");
  command.add("--params-file", command.write("/**: {ros__parameters: {a: 3}}\n"));
  EXPECT_EQ(command.arguments().read_for(kNode).parameters, (ParameterMap{{"a", std::int64_t{3}}}));
}

TEST(ParameterArguments, OtherNodesAreNamedOnce) {
  Command command;
  command.add("--params-file", command.write("camera: {ros__parameters: {a: 1}}\n"));
  command.add("-p", "camera:a:=2");
  command.add("-p", "lidar:a:=2");
  const auto read = command.arguments().read_for(kNode);
  EXPECT_THAT(read.problems, IsEmpty());
  EXPECT_THAT(read.others, ElementsAre("camera", "lidar"));
  EXPECT_THAT(read.parameters, IsEmpty());
}

TEST(ParameterArguments, AChangedFileIsReadAgainInItsTurn) {
  Command command;
  const std::string file = command.write("/**: {ros__parameters: {a: 1, b: 1}}\n");
  command.add("--params-file", file);
  command.add("-p", "a:=1.5");
  ParameterArguments arguments = command.arguments();
  ASSERT_THAT(arguments.read_for(kNode).problems, IsEmpty());
  for (const Kind& kind : kinds()) {
    std::ofstream(file) << fmt::format("/**: {{ros__parameters: {{a: {0}, b: {0}}}}}\n", kind.yaml);
    EXPECT_EQ(arguments.read_for(kNode).parameters, (ParameterMap{{"a", 1.5}, {"b", kind.value}}));
  }
  std::ofstream(file) << "a: [1\n";
  const auto wrong = arguments.read_for(kNode);
  EXPECT_THAT(wrong.problems, ElementsAre(HasSubstr(file)));
  EXPECT_THAT(wrong.parameters, IsEmpty());
}

// As --params-file <(...) has it.
TEST(ParameterArguments, APipeIsReadOnceAndKept) {
  const std::string pipe = test::scratch_folder() + "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  Command command;
  command.add("-p", "a:=1");
  command.add("--params-file", pipe);
  command.add("-p", "b:=2");
  EXPECT_THAT(command.problems(), IsEmpty());  // it is not touched
  std::thread writer([&] {
    std::ofstream(pipe) << "/**: {ros__parameters: {a: [x], b: [x]}}\n" << std::flush;
  });
  ParameterArguments arguments = command.arguments();
  const auto first = arguments.read_for(kNode);
  writer.join();
  const ParameterMap expected{{"a", std::vector<std::string>{"x"}}, {"b", std::int64_t{2}}};
  EXPECT_EQ(first.parameters, expected);
  EXPECT_EQ(arguments.read_for(kNode).parameters, expected);
}

// rcl would take the first kind, without a word.
TEST(ParameterArguments, AKeyThatAPipeGivesTwiceIsRefused) {
  const std::string pipe = test::scratch_folder() + "twice";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  std::thread writer([&] {
    std::ofstream(pipe) << "/**: {ros__parameters: {a: 1, a: x}}\n" << std::flush;
  });
  EXPECT_THAT(read_parameter_file(pipe).problems, ElementsAre(HasSubstr("\"a\" is given twice")));
  writer.join();
}

// The first bytes are valid YAML: without the second key, as on a machine without memory.
TEST(ParameterArguments, APipeWhoseCopyIsCutIsRefused) {
  const std::string pipe = test::scratch_folder() + "cut";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const std::string first = "/**:\n  ros__parameters:\n    a: 1\n";
  std::thread writer([&] { std::ofstream(pipe) << first << "    b: 2\n" << std::flush; });
  ::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  const rlimit cut{first.size(), before.rlim_max};
  ::setrlimit(RLIMIT_FSIZE, &cut);
  const ParameterFile read = read_parameter_file(pipe);
  ::setrlimit(RLIMIT_FSIZE, &before);
  ::signal(SIGXFSZ, SIG_DFL);
  writer.join();
  EXPECT_THAT(read.problems, ElementsAre(pipe + ": cannot be read"));
  EXPECT_THAT(read.sections, IsEmpty());
}

TEST(ParameterArguments, AllAreReadBeforeRclDoes) {
  Command command;
  const std::string file = command.write("a: [1\n");
  const std::string other = test::scratch_folder() + "nowhere.yaml";
  command.add("--params-file", file);
  command.add("-p", "x:=1");
  command.add("--params-file", other);
  command.add("-p", "token");
  command.add("-p", "token:=");
  command.add("-p", "auth.token:=[secret, ");
  command.add("-p", "/lidar:a:=1");
  EXPECT_THAT(command.problems(),
              ElementsAre(ContainsRegex("[0-9]+.yaml:[0-9]+:[0-9]+: ."),
                          HasSubstr(other + ": cannot be opened"), "-p token: expected KEY:=VALUE",
                          "-p token: expected a value behind :=, an empty text is '\"\"'",
                          AllOf(HasSubstr("-p auth.token: "), Not(HasSubstr("secret"))),
                          "-p /lidar:a: expected KEY:=VALUE, or NODE:KEY:=VALUE with a node's name "
                          "without its namespace"));
}

TEST(ParameterArguments, ARuleWithATypingErrorShowsNoValue) {
  for (const char* rule :
       {"auth.token=secret", "auth.token:secret", "auth.token: secret", "auth.token secret"})
    EXPECT_EQ(read_parameter_rule(rule).problem(), "-p auth.token: expected KEY:=VALUE") << rule;
}

TEST(ParameterArguments, AFolderIsNoFile) {
  EXPECT_THAT(read_parameter_file(test::scratch_folder()).problems,
              ElementsAre(HasSubstr("cannot be read")));
}

TEST(ParameterArguments, TheRestIsLeftForRcl) {
  const char* const words[] = {
      "server",    "-p",      "no:=ros",       "--ros-args", "-p",      "x:=1",
      "--enclave", "-p",      "--params-file", "a.yaml",     "-r",      "--param",
      "--",        "--param", "y:=1",          "--ros-args", "--param", "z:=1",
      "-p"};
  const int count = static_cast<int>(std::size(words));
  EXPECT_THAT(ParameterArguments::without(count, words),
              ElementsAre("server", "-p", "no:=ros", "--ros-args", "--enclave", "-p", "-r",
                          "--param", "--", "--param", "y:=1", "--ros-args", "-p"));
  EXPECT_THAT(ParameterArguments(count, words).files(), ElementsAre("a.yaml"));
}

}  // namespace
}  // namespace connect_bridge::ros
