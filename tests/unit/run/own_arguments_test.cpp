#include "run/own_arguments.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

namespace connect_bridge {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// As main() has them.
struct Given {
  explicit Given(std::vector<std::string> words) : texts(std::move(words)) {
    for (auto& text : texts) argv.push_back(text.data());
    argv.push_back(nullptr);
  }
  [[nodiscard]] int argc() const { return static_cast<int>(texts.size()); }
  // What every user of the machine sees.
  [[nodiscard]] std::vector<std::string> seen() const { return {argv.begin(), argv.end() - 1}; }
  std::vector<std::string> texts;
  std::vector<char*> argv;
};

std::vector<std::string> words_of(OwnArguments& own) {
  EXPECT_EQ(own.words()[own.count()], nullptr);
  return {own.words(), own.words() + own.count()};
}

TEST(OwnArguments, HaveTheSecretsThatTheGivenOnesHaveNoLonger) {
  const std::vector<std::string> words{"client",
                                       "wss+pair://robot:9090/#9a86.fh2L",
                                       "--ros-args",
                                       "-p",
                                       "auth.token:=secret",
                                       "-p",
                                       "url:=ws://robot/#x"};
  Given given(words);
  OwnArguments own(given.argc(), given.argv.data());
  EXPECT_THAT(given.seen(), ElementsAre("client", "wss+pair://robot:9090/#xxxxxxxxx", "--ros-args",
                                        "-p", "auth.token:=xxxxxx", "-p", "url:=ws://robot/#x"));
  EXPECT_EQ(words_of(own), words);
  Given server({"server", "--pair", "--via", "wss+relay://robot7@relay/#code"});
  OwnArguments line(server.argc(), server.argv.data());
  EXPECT_EQ(server.seen().back(), "wss+relay://robot7@relay/#xxxx");
  EXPECT_EQ(words_of(line).back(), "wss+relay://robot7@relay/#code");
}

TEST(OwnArguments, ASecretBehindATypingErrorIsHidden) {
  Given given({"client", "--ros-args", "-p", "auth.token=secret", "-p", "auth.token:secret",
               "auth.token: secret", "-p", "auth.token_file:=a.token", "x:auth.token=secret"});
  OwnArguments own(given.argc(), given.argv.data());
  EXPECT_THAT(given.seen(), ElementsAre("client", "--ros-args", "-p", "auth.token=xxxxxx", "-p",
                                        "auth.token:xxxxxx", "auth.token: xxxxxx", "-p",
                                        "auth.token_file:=a.token", "x:auth.token=xxxxxx"));
}

TEST(OwnArguments, ADashIsTheLineThatIsGiven) {
  Given given({"client", "-", "--ros-args", "-p", "x:=-"});
  OwnArguments own(given.argc(), given.argv.data());
  std::istringstream in("  wss+pair://robot:9090/#9a86.fh2L \nmore\n");
  EXPECT_EQ(own.read_from(in), "");
  EXPECT_THAT(words_of(own), ElementsAre("client", "wss+pair://robot:9090/#9a86.fh2L", "--ros-args",
                                         "-p", "x:=-"));
  EXPECT_EQ(given.seen()[1], "-");
}

TEST(OwnArguments, WithoutADashNothingIsRead) {
  Given given({"server", "--pair", "--ros-args", "-"});
  OwnArguments own(given.argc(), given.argv.data());
  std::istringstream in("wss+relay://robot7@relay/#code\n");
  EXPECT_EQ(own.read_from(in), "");
  EXPECT_EQ(in.tellg(), 0);
  EXPECT_THAT(words_of(own), ElementsAre("server", "--pair", "--ros-args", "-"));
}

TEST(OwnArguments, AnotherLineIsRefusedAndNotShown) {
  for (const std::string& text :
       {std::string{}, std::string{"\n"}, std::string{"a-secret\n"}, std::string(10000, 'w')}) {
    Given given({"client", "-"});
    OwnArguments own(given.argc(), given.argv.data());
    std::istringstream in(text);
    const std::string problem = own.read_from(in);
    EXPECT_THAT(problem, HasSubstr("expected an invitation"));
    EXPECT_EQ(problem.find("a-secret"), std::string::npos);
  }
}

}  // namespace
}  // namespace connect_bridge
