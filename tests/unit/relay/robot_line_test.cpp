#include "relay/robot_line.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pwd.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>

#include "access/login/authenticator.hpp"
#include "config/invitation.hpp"
#include "net/tls/authority.hpp"
#include "relay/robot_names.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge {
namespace {

// Files are written now, and a clock that is behind them is not believed. Files have whole seconds.
const Stamp kNow = std::chrono::duration_cast<std::chrono::seconds>(
                       std::chrono::system_clock::now().time_since_epoch())
                       .count() *
                   kStampSecond;

TEST(RobotLine, OfARelayThatIsMadeByItIsWhatARobotLogsInWith) {
  const std::string folder = test::scratch_folder() + "robot_line";
  const Url url{true, "relay.example", 443, "/", "robot7"};
  ASSERT_EQ(make_relay_files(folder, url), "");
  std::string problem;
  const Invitation line =
      parse_relay_line(add_robot(folder + "/relay.yaml", url, kNow, problem), problem);
  ASSERT_EQ(problem, "");
  EXPECT_EQ(line.url, "wss://robot7@relay.example:443/");
  EXPECT_EQ(line.pin, pin_of_file(folder + "/server.crt", problem));
  EXPECT_FALSE(std::filesystem::exists(folder + "/ca.key"));
  // What is there stays.
  ASSERT_EQ(make_relay_files(folder, url), "");
  EXPECT_EQ(line.pin, pin_of_file(folder + "/server.crt", problem));
  LoginOptions login;
  login.token_file = folder + "/robots.yaml";
  const auto whose = [&](const std::string& token, Stamp now = kNow) {
    const AuthSetup robots = make_authenticator({login, std::nullopt}, kNow);
    EXPECT_TRUE(robots.authenticator) << testing::PrintToString(robots.problems);
    return robots.authenticator->judge({"token", Bytes(token.begin(), token.end()), "peer"}, now)
        .identity;
  };
  const auto judged = whose(line.code);
  ASSERT_TRUE(judged);
  EXPECT_EQ(judged->name, "robot7");
  EXPECT_THAT(judged->groups, testing::ElementsAre(kLineGroup));
  constexpr Stamp kDay = 24 * 3600 * kStampSecond;
  EXPECT_TRUE(whose(line.code, kNow + kDay - 1));
  EXPECT_FALSE(whose(line.code, kNow + kDay));
  const Invitation other = parse_relay_line(
      add_robot(folder + "/relay.yaml", {true, "relay.example", 443, "/", "robot8"}, kNow, problem),
      problem);
  // The name is its token's, and the code is used.
  const std::string own = "a-token-of-its-own";
  const auto give = [&](const std::string& token, const std::string& code) {
    return hand_over(login.token_file, "robot7", sha256(view_of(token)), sha256(view_of(code)),
                     kNow);
  };
  EXPECT_THAT(give(own, other.code), testing::HasSubstr("is there no more"));
  EXPECT_EQ(give(own, line.code), "");
  // Another relay of this file, or this one before it has read it again, knows it still.
  EXPECT_THAT(give("a-token-of-another", line.code), testing::HasSubstr("is there no more"));
  EXPECT_FALSE(whose(line.code));
  ASSERT_TRUE(whose(own));
  EXPECT_EQ(whose(own)->name, "robot7");
  EXPECT_THAT(whose(own)->groups, testing::IsEmpty());
  EXPECT_TRUE(whose(other.code));
}

TEST(RobotLine, IsNotMadeForAFileThatIsWrong) {
  std::string problem;
  EXPECT_EQ(add_robot(test::scratch_folder() + "no such file", Url{}, Stamp{0}, problem), "");
  EXPECT_THAT(problem, testing::HasSubstr("cannot be read"));
}

// Under Ansible, or in CI, the output is a log.
TEST(RobotLine, IsShownOnATerminalAndElseKeptForItsOwnerAlone) {
  const std::string folder = test::scratch_folder();
  const std::string file = folder + "/robot7.line";
  std::string problem;
  const std::string shown = line_to_print("robot7", "wss+relay://r#code", true, folder, problem);
  EXPECT_THAT(shown, testing::HasSubstr("--pair --via 'wss+relay://r#code'"));
  EXPECT_FALSE(std::filesystem::exists(file));
  const std::string logged = line_to_print("robot7", "wss+relay://r#code", false, folder, problem);
  EXPECT_EQ(problem, "");
  EXPECT_THAT(logged,
              testing::HasSubstr("The registration command of robot7 is in '" + file + "'"));
  EXPECT_EQ(logged.find("code"), std::string::npos);
  EXPECT_EQ(test::content(file), shown);
  using std::filesystem::perms;
  EXPECT_EQ(std::filesystem::status(file).permissions(), perms::owner_read | perms::owner_write);
  EXPECT_EQ(line_to_print("robot7", "line", false, "/nowhere", problem), "");
  EXPECT_THAT(problem, testing::HasSubstr("/nowhere/robot7.line"));
}

TEST(RobotLine, WithoutAHomeInTheEnvironmentTheFolderIsThatOfTheUser) {
  const std::string home = ::getenv("HOME") ? ::getenv("HOME") : "";
  ::unsetenv("HOME");
  const std::string folder = relay_folder();
  ::setenv("HOME", "/given", 1);
  EXPECT_EQ(relay_folder(), "/given/.connect_relay");
  ::setenv("HOME", home.c_str(), 1);
  EXPECT_EQ(folder, std::string(::getpwuid(::geteuid())->pw_dir) + "/.connect_relay");
}

}  // namespace
}  // namespace connect_bridge
