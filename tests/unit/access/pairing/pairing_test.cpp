#include "access/pairing/pairing.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <thread>

#include "access/login/token_file.hpp"
#include "access/pairing/invitation_text.hpp"
#include "access/pairing/pairing_folder.hpp"
#include "config/config.hpp"
#include "config/explain_right.hpp"
#include "core/base/hex.hpp"
#include "core/base/sha256.hpp"
#include "unit/access/pairing/pairing_start.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

TEST_F(PairingStart, AServerStartsTheSameWayLater) {
  const Start first = serve({"--pair", "robot.local"}, {{"listen.port", std::int64_t{9443}}});
  ASSERT_THAT(first.problems, IsEmpty());
  ASSERT_TRUE(first.invitation);
  EXPECT_THAT(first.news, ElementsAre(HasSubstr("params.yaml")));
  EXPECT_THAT(parse_config(first.parameters, Role::kServer, {}).problems, IsEmpty());
  EXPECT_THAT(serve({}).parameters, IsEmpty());  // nothing stays of what may not even start
  EXPECT_EQ(first.keep(), "");
  EXPECT_TRUE(first.folder->has("server.key"));
  EXPECT_FALSE(first.folder->has("ca.key")) << "it signs whatever it is asked to";
  const Start later = serve({});
  EXPECT_THAT(later.problems, IsEmpty());
  EXPECT_EQ(later.parameters, first.parameters);
  EXPECT_FALSE(later.invitation);
  const Start again = serve({"--pair", "robot.local"});
  EXPECT_EQ(again.invitation->pin, first.invitation->pin);
  EXPECT_NE(again.invitation->code, first.invitation->code);
  EXPECT_FALSE(again.keep);
  const Start moved = serve({"--pair", "robot.local"}, {{"listen.port", std::int64_t{443}}});
  EXPECT_EQ(moved.keep(), "");
  EXPECT_EQ(serve({}).parameters, moved.parameters);
}

// As in a container whose root is read-only.
TEST_F(PairingStart, WhereNoFolderCanBeMadeTheCureIsNamed) {
  ::setenv("ROS_HOME", "/proc/nowhere", 1);
  EXPECT_THAT(serve({"--pair"}).problems,
              ElementsAre(testing::AllOf(HasSubstr("/proc/nowhere cannot be made"),
                                         HasSubstr("set HOME or ROS_HOME"))));
}

// A client that pairs to operate is in one more group, for which the same parameters have a rule.
TEST_F(PairingStart, AClientMayLookUnlessItIsToOperate) {
  const Start look = serve({"--pair"});
  EXPECT_THAT(look.groups, ElementsAre("paired"));
  const Start operate = serve({"--pair", "--operate"});
  EXPECT_THAT(operate.groups, ElementsAre("paired", "operators"));
  EXPECT_EQ(operate.parameters, look.parameters);
  EXPECT_EQ(std::get<std::vector<std::string>>(look.parameters.at("rule.operate.groups")),
            std::vector<std::string>{"operators"});
}

TEST_F(PairingStart, AServerThatRunsTakesTheClient) {
  const PairingFolder folder("/connect_server");
  ASSERT_EQ(serve({"--pair"}).keep(), "");
  EXPECT_FALSE(folder.running());
  {
    const RunningMark mark(folder.running_file(), 9443);
    const Start asks = serve({"--pair", "robot.local", "--operate"});
    ASSERT_THAT(asks.problems, IsEmpty());
    ASSERT_TRUE(asks.running);
    EXPECT_EQ(asks.running->process, ::getpid());
    EXPECT_EQ(asks.running->port, 9443);
    EXPECT_EQ(asks.invitation->url, "wss://robot.local/");
    EXPECT_EQ(invite(asks), "");
    std::string line;
    std::getline(std::ifstream{folder.invited_file()}, line);
    EXPECT_EQ(line, to_hex(sha256(view_of(asks.invitation->code))) + " paired operators");
    // It would not get what is given here, nor may two share the clients.
    EXPECT_THAT(serve({"--pair"}, {{"listen.port", std::int64_t{1}}}).problems,
                ElementsAre(HasSubstr("gets no other parameters")));
    EXPECT_THAT(serve({}).problems, ElementsAre(HasSubstr("end it first")));
  }
  EXPECT_FALSE(folder.running());
  EXPECT_THAT(serve({}).problems, IsEmpty());
}

// To be asked for does not take the mark: a server that starts meanwhile gets it.
TEST_F(PairingStart, WhoAsksForARunningServerKeepsNobodyFromBeingOne) {
  const PairingFolder folder("/connect_server");
  ASSERT_EQ(folder.make(), "");
  std::atomic<bool> ends = false;
  std::thread asks([&] {
    while (!ends) static_cast<void>(folder.running());
  });
  for (int i = 0; i < 200; ++i) {
    const RunningMark mark(folder.running_file(), 9443);
    EXPECT_TRUE(folder.running()) << i;
  }
  ends = true;
  asks.join();
}

// Neither to read the robot's log nor to write into it.
TEST_F(PairingStart, TheLogOfTheRobotIsNobodys) {
  const auto parsed = parse_config(serve({"--pair"}).parameters, Role::kServer, {});
  ASSERT_THAT(parsed.problems, IsEmpty());
  for (const char* group : {"paired", "operators"}) {
    RightQuestion question;
    question.who.groups = {"paired", group};
    for (const Direction direction : {Direction::kExport, Direction::kImport}) {
      question.direction = direction;
      question.name = "/rosout";
      const auto log = explain_right(*parsed.config, question);
      EXPECT_FALSE(log.allowed) << log.text;
      EXPECT_THAT(log.text, HasSubstr("rule \"look\" (rule.look.deny: \"/rosout\")"));
    }
    question.direction = Direction::kExport;
    question.name = "/scan";
    EXPECT_TRUE(explain_right(*parsed.config, question).allowed);
    question.name = "/_hidden";
    EXPECT_FALSE(explain_right(*parsed.config, question).allowed);
  }
}

TEST_F(PairingStart, WhoSaysMoreGoesByThatAlone) {
  const Start paired = serve({"--pair"});
  ASSERT_THAT(paired.problems, IsEmpty());
  ASSERT_EQ(paired.keep(), "");
  for (const char* key : {"auth.token_file", "tls.certificate"}) {
    const ParameterMap given{{key, std::string{"x"}}};
    EXPECT_EQ(serve({}, given).parameters, given);
    EXPECT_THAT(serve({"--pair"}, given).problems, ElementsAre(HasSubstr("leave out")));
  }
  const ParameterMap rules{{"rules", std::vector<std::string>{"mine"}},
                           {"rule.mine.export_topics", std::vector<std::string>{"/a"}}};
  EXPECT_FALSE(serve({}, rules).parameters.contains("rule.look.export_topics"));
  EXPECT_TRUE(serve({}, rules).parameters.contains("tls.certificate"));
}

// Without a prefix /scan of both would be one topic at their operator.
TEST_F(PairingStart, AnotherRobotOfAnOperatorNeedsAPrefix) {
  const Start first = join({kLine});
  ASSERT_EQ(first.joining->keep(), "");
  const auto another = [](const ParameterMap& given, std::vector<std::string> words = {kLine}) {
    return start_with(given, read_arguments(words, Role::kClient), "/robot2");
  };
  EXPECT_THAT(another({}).problems, ElementsAre(HasSubstr("-p prefix:=/robot2")));
  EXPECT_FALSE(another({}).joining);
  const Start apart = another({{"prefix", std::string{"/robot2"}}});
  ASSERT_THAT(apart.problems, IsEmpty());
  ASSERT_EQ(apart.joining->keep(), "");
  EXPECT_EQ(another({}, {}).parameters.at("prefix"), ParameterValue{"/robot2"});
  EXPECT_THAT(join({kLine}).problems, IsEmpty()) << "the first one has its own names";
}

TEST_F(PairingStart, AHostThatIsNoneIsRefused) {
  for (const char* host : {"ro bot", "robot/x#", "a@b"})
    EXPECT_THAT(serve({"--pair", host}).problems, ElementsAre(HasSubstr("expected a host")))
        << host;
}

TEST_F(PairingStart, AClientStartsWithoutWordsOnceItIsLoggedIn) {
  const Start first = join({kLine});
  ASSERT_THAT(first.problems, IsEmpty());
  ASSERT_TRUE(first.joining);
  EXPECT_THAT(first.joining->credential, testing::StartsWith("00112233445566778899aabbccddeeff "));
  EXPECT_EQ(std::get<std::string>(first.parameters.at("url")), "wss://robot.local:9090/");
  EXPECT_EQ(join({}).parameters.size(), 0U);  // not before that
  const Start retried = join({kLine});
  EXPECT_EQ(retried.joining->credential, first.joining->credential);
  EXPECT_EQ(first.joining->keep(), "");
  EXPECT_EQ(join({}, {{"prefix", std::string{"/r1"}}}).parameters.size(),
            first.parameters.size() + 1);
  const Start same_line = join({kLine});
  EXPECT_FALSE(same_line.joining);
  EXPECT_EQ(same_line.parameters, first.parameters);
}

// Changes by its owner in params.yaml stay.
TEST_F(PairingStart, AnotherServerTakesThePlaceWhenItHasAnswered) {
  const ParameterMap own{{"status_file", std::string{"a \"b\" \\ c: {d}"}},
                         {"prefix", std::string{"/r1"}}};
  const PairingFolder folder("/robot1/connect_client");
  ASSERT_EQ(folder.make(), "");
  ::chmod(folder.path().c_str(), 0702);
  EXPECT_THAT(folder.make(), HasSubstr("every user of this machine may change the folder"));
  ::chmod(folder.path().c_str(), 0700);
  ASSERT_EQ(folder.write_parameters(own), "");
  ASSERT_EQ(join({kLine}).joining->keep(), "");
  const std::string former = std::get<std::string>(join({}).parameters.at("auth.token_file"));
  std::string other = kLine;
  other.replace(other.find('#') + 1, 4, "ffff");
  const Start next = join({other});
  EXPECT_TRUE(std::filesystem::exists(former));
  EXPECT_EQ(next.joining->keep(), "");
  EXPECT_FALSE(std::filesystem::exists(former));
  const ParameterMap last = join({}).parameters;
  EXPECT_NE(std::get<std::string>(last.at("auth.token_file")), former);
  for (const auto& [key, value] : own) EXPECT_EQ(last.at(key), value);
}

TEST_F(PairingStart, AServerIsReachedByARelayThenAndLater) {
  const std::string line = kRelayLine;
  const Start first = serve({"--pair", "--via", line});
  ASSERT_THAT(first.problems, IsEmpty());
  EXPECT_EQ(first.invitation->url, "wss://robot7@relay.example:443/");
  EXPECT_THAT(invitation_text(*first.invitation, 9090),
              testing::AllOf(HasSubstr("'wss+pair://robot7@relay.example:443/#"),
                             testing::Not(HasSubstr("connects to"))));
  const Parsed parsed = parse_config(first.parameters, Role::kServer, {});
  EXPECT_THAT(parsed.problems, IsEmpty());
  EXPECT_EQ(parsed.config->listen.addresses, std::vector<std::string>{"127.0.0.1"});
  EXPECT_EQ(first.keep(), "");
  EXPECT_EQ(serve({}).parameters, first.parameters);
  EXPECT_EQ(serve({"--pair"}).invitation->url, first.invitation->url);
  EXPECT_THAT(serve({"--pair", "--via", kLine}).problems,
              ElementsAre(HasSubstr("--pair: the registration command is not complete")));
  // Another relay's token takes the place when that start has succeeded.
  std::string other = line;
  other.replace(other.find('#') + 1, 4, "ffff");
  const std::string file = std::get<std::string>(first.parameters.at("listen.relay.token_file"));
  const Start moved = serve({"--pair", "--via", other});
  EXPECT_TRUE(std::filesystem::exists(file));
  EXPECT_EQ(serve({}).parameters, first.parameters);
  EXPECT_EQ(moved.keep(), "");
  EXPECT_FALSE(std::filesystem::exists(file));
  EXPECT_EQ(serve({}).parameters, moved.parameters);
  EXPECT_THAT(serve({"--via", line}).problems, ElementsAre(HasSubstr("give --pair")));
  EXPECT_THAT(serve({"--pair", "host", "--via", line}).problems, SizeIs(1));
  // The client verifies the robot's key.
  const Start client = join({to_text(*first.invitation)});
  EXPECT_THAT(parse_config(client.parameters, Role::kClient, {}).problems, IsEmpty());
}

// Another operator gets what the robot's owner allows, not what a pairing would write.
TEST_F(PairingStart, RulesThatTheOwnerHasChangedStay) {
  const std::string line = kLine + std::string{".robot"};
  ASSERT_EQ(join({"--robot", line}).joining->keep(), "");
  ParameterMap own = join({}).parameters;
  own["rule.look.export_topics"] = std::vector<std::string>{"/camera"};
  ASSERT_EQ(PairingFolder("/robot1/connect_client").write_parameters(own), "");
  std::string other = line;
  other.replace(other.find('#') + 1, 4, "ffff");
  const Start next = join({"--robot", "--operate", other});
  EXPECT_THAT(next.news.back(), HasSubstr("your rules in "));
  ASSERT_EQ(next.joining->keep(), "");
  EXPECT_EQ(join({}).parameters.at("rule.look.export_topics"), own.at("rule.look.export_topics"));
  EXPECT_FALSE(next.parameters.contains("rule.operate.import_topics"));
}

TEST_F(PairingStart, AFolderThatOthersMayChangeIsUsedWhereThatIsAskedFor) {
  const PairingFolder folder("/connect_server");
  ASSERT_EQ(serve({"--pair"}).keep(), "");
  ::chmod(folder.path().c_str(), 0702);
  EXPECT_THAT(serve({}).problems, ElementsAre(HasSubstr("every user of this machine may change")));
  EXPECT_THAT(serve({"--pair"}).problems, SizeIs(1));
  const ParameterMap lax{{"strict_modes", false}};
  EXPECT_THAT(serve({}, lax).problems, IsEmpty());
  EXPECT_THAT(serve({"--pair"}, lax).problems, IsEmpty());
  ::chmod(folder.path().c_str(), 0700);
  // Which end is the robot stands there, too.
  const PairingFolder robot("/robot1/connect_client");
  ASSERT_EQ(join({"--robot", kLine + std::string{".robot"}}).joining->keep(), "");
  ::chmod(robot.path().c_str(), 0702);
  EXPECT_EQ(robot_end({}, {}, "/robot1/connect_client"), Role::kServer);
  EXPECT_EQ(robot_end(lax, {}, "/robot1/connect_client"), Role::kClient);
  ::chmod(robot.path().c_str(), 0700);
}

// After a full disk or an editing mistake.
TEST_F(PairingStart, ATokenFileThatIsNotWholeIsRefused) {
  const Start first = join({kLine});
  const std::string file = std::get<std::string>(first.parameters.at("auth.token_file"));
  std::filesystem::resize_file(file, 5);
  EXPECT_THAT(join({kLine}).problems,
              ElementsAre(HasSubstr(file + ": the token has 5 characters")));
}

TEST_F(PairingStart, AnInvitationAndAnAddressAreRefused) {
  EXPECT_THAT(join({kLine}, {{"url", std::string{"wss://other/"}}}).problems,
              ElementsAre(HasSubstr("leave out")));
}

}  // namespace
}  // namespace connect_bridge
