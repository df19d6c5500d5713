#include "relay/robot_line.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "auth/authenticator.hpp"
#include "config/invitation.hpp"
#include "net/authority.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge {
namespace {

TEST(RobotLine, OfARelayThatIsMadeByItIsWhatARobotLogsInWith) {
  const std::string folder = test::scratch_folder() + "robot_line";
  const Url url{true, "relay.example", 443, "/", "robot7"};
  ASSERT_EQ(make_relay_files(folder, url), "");
  std::string problem;
  const Invitation line =
      parse_relay_line(add_robot(folder + "/relay.yaml", url, problem), problem);
  ASSERT_EQ(problem, "");
  EXPECT_EQ(line.url, "wss://robot7@relay.example:443/");
  EXPECT_EQ(line.pin, pin_of_file(folder + "/server.crt", problem));
  // What is there stays.
  ASSERT_EQ(make_relay_files(folder, url), "");
  EXPECT_EQ(line.pin, pin_of_file(folder + "/server.crt", problem));
  LoginOptions login;
  login.token_file = folder + "/robots.yaml";
  const AuthSetup robots = make_authenticator({login, std::nullopt}, Stamp{0});
  ASSERT_TRUE(robots.authenticator) << testing::PrintToString(robots.problems);
  const Bytes token(line.code.begin(), line.code.end());
  const Judgement judged = robots.authenticator->judge({"token", token, "peer"}, Stamp{0});
  ASSERT_TRUE(judged.identity);
  EXPECT_EQ(judged.identity->name, "robot7");
}

TEST(RobotLine, IsNotMadeForAFileThatIsWrong) {
  std::string problem;
  EXPECT_EQ(add_robot(test::scratch_folder() + "no such file", Url{}, problem), "");
  EXPECT_THAT(problem, testing::HasSubstr("cannot be read"));
}

}  // namespace
}  // namespace connect_bridge
