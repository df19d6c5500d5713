#include "run/pairing.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pwd.h>
#include <stdlib.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <thread>

#include "auth/token_file.hpp"
#include "config/config.hpp"
#include "config/explain_right.hpp"
#include "core/base/hex.hpp"
#include "core/base/sha256.hpp"
#include "run/pairing_folder.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

constexpr char kRelayLine[] =
    "wss+relay://robot7@relay.example:443/"
    "#aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa."
    "47DEQpj8HBSa-_TImW-5JCeuQeRkm5NMpJWZG3hSuFU";
constexpr char kLine[] =
    "wss+pair://robot.local:9090/"
    "#00112233445566778899aabbccddeeff.47DEQpj8HBSa-_TImW-5JCeuQeRkm5NMpJWZG3hSuFU";

class PairingStart : public testing::Test {
 protected:
  PairingStart() {
    static int number = 0;
    ::setenv("ROS_HOME", (test::scratch_folder() + "home" + std::to_string(++number)).c_str(), 1);
  }
  ~PairingStart() override { ::unsetenv("ROS_HOME"); }

  static Start serve(const std::vector<std::string>& words, const ParameterMap& given = {}) {
    return start_with(given, read_arguments(words, Role::kServer), "/connect_server");
  }
  static Start join(const std::vector<std::string>& words, const ParameterMap& given = {}) {
    return start_with(given, read_arguments(words, Role::kClient), "/robot1/connect_client");
  }
};

TEST(Invitation, NamesThePortWhereTheServerListens) {
  Invitation invitation{"wss://[::1]/connect", "c", "p"};
  EXPECT_THAT(invitation_text(invitation, 9090), HasSubstr("wss+pair://[::1]:9090/connect#"));
  invitation.url = "wss://robot.example:443/";
  EXPECT_THAT(invitation_text(invitation, 9090), HasSubstr("'wss+pair://robot.example:443/#"));
}

TEST(Invitation, SaysWhenAnotherPortIsDialed) {
  const auto text = [](const std::string& url) { return invitation_text({url, "c", "p"}, 9090); };
  EXPECT_THAT(text("wss://robot.example:443/"),
              HasSubstr("It dials robot.example:443, and this server listens on port 9090"));
  for (const char* same : {"wss://robot.example/", "wss://robot.example:9090/", "wss://[::1]/"})
    EXPECT_THAT(text(same), testing::Not(HasSubstr("It dials"))) << same;
}

// In a journal, or the log of a container, others would read the code.
TEST_F(PairingStart, AnInvitationIsPrintedToATerminalOnly) {
  const Start start = serve({"--pair"});
  std::string problem;
  const auto print = [&](bool terminal) {
    return invitation_to_print(start, 9090, terminal, problem);
  };
  const std::string code = start.invitation->code;
  const std::string file = start.folder->invitation_file();
  EXPECT_THAT(print(true), HasSubstr(code));
  EXPECT_FALSE(start.folder->has("invitation"));
  EXPECT_THAT(print(false), testing::AllOf(HasSubstr(file), testing::Not(HasSubstr(code))));
  EXPECT_THAT(test::content(file), HasSubstr(code));
  EXPECT_EQ(std::filesystem::status(file).permissions(),
            std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
  EXPECT_EQ(problem, "");
  std::filesystem::remove_all(start.folder->path());
  EXPECT_EQ(print(false), "");
  EXPECT_THAT(problem, HasSubstr("the invitation cannot be written"));
}

// The shell's history repeats it.
TEST(Invitation, ARefusedOneIsNotShownAgain) {
  Joining joining;
  joining.made_by = "server --pair";
  EXPECT_THAT(refused_invitation(joining, 4003),
              testing::AllOf(HasSubstr("the server refused the invitation"),
                             HasSubstr("'server --pair' makes another one there")));
  for (const std::uint16_t code : {1001, 4004, 4012, 4013, 4015, 4016})
    EXPECT_EQ(refused_invitation(joining, code), "") << code;
  EXPECT_EQ(refused_invitation(joining, std::nullopt), "");
}

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
                             testing::Not(HasSubstr("It dials"))));
  const Parsed parsed = parse_config(first.parameters, Role::kServer, {});
  EXPECT_THAT(parsed.problems, IsEmpty());
  EXPECT_EQ(parsed.config->listen.addresses, std::vector<std::string>{"127.0.0.1"});
  EXPECT_EQ(first.keep(), "");
  EXPECT_EQ(serve({}).parameters, first.parameters);
  EXPECT_EQ(serve({"--pair"}).invitation->url, first.invitation->url);
  EXPECT_THAT(serve({"--pair", "--via", kLine}).problems,
              ElementsAre(HasSubstr("--pair: the relay")));
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

// The robot dials, and its rules are there: by them an operator may look, or operate it.
TEST_F(PairingStart, ARobotThatDialsSaysWhatItsOperatorMayDo) {
  const Start server = serve({"--pair", "--drive", "desk.local"});
  EXPECT_THAT(server.problems, IsEmpty());
  const Parsed desk = parse_config(server.parameters, Role::kServer, {});
  ASSERT_THAT(desk.problems, IsEmpty());
  EXPECT_FALSE(desk.config->is_robot());
  EXPECT_TRUE(desk.config->default_rules);
  EXPECT_EQ(server.keep(), "");
  EXPECT_EQ(serve({}).parameters, server.parameters);
  const std::string line = to_text(*server.invitation);
  EXPECT_THAT(invitation_text(*server.invitation, 9090),
              HasSubstr("client --robot 'wss+pair://desk.local:9090/#"));

  for (const bool operates : {false, true}) {
    const Start robot = operates ? join({"--robot", "--operate", line}) : join({"--robot", line});
    ASSERT_THAT(robot.problems, IsEmpty());
    EXPECT_THAT(robot.news.back(), HasSubstr(operates ? "set parameters" : "nothing"));
    const Parsed parsed = parse_config(robot.parameters, Role::kClient, {});
    ASSERT_THAT(parsed.problems, IsEmpty());
    EXPECT_TRUE(parsed.config->is_robot());
    RightQuestion question;
    const auto allows = [&](OpenedBy what, const char* name, Direction direction) {
      question = {what, name, {}, direction, {}};
      return explain_right(*parsed.config, question).allowed;
    };
    EXPECT_TRUE(allows(OpenedBy::kTopics, "/scan", Direction::kExport));
    EXPECT_FALSE(allows(OpenedBy::kTopics, "/rosout", Direction::kExport));
    EXPECT_FALSE(allows(OpenedBy::kTopics, "/rosout", Direction::kImport));
    for (const OpenedBy what : {OpenedBy::kServices, OpenedBy::kActions, OpenedBy::kParameters}) {
      EXPECT_EQ(allows(what, "/a", Direction::kExport), operates);
      EXPECT_FALSE(allows(what, "/a", Direction::kImport));
    }
    EXPECT_EQ(allows(OpenedBy::kTopics, "/cmd_vel", Direction::kImport), operates);
  }

  // What its owner changes stays, and one more word opens nothing by itself.
  const Start first = join({"--robot", line});
  EXPECT_EQ(first.joining->keep(), "");
  EXPECT_EQ(join({}).parameters, first.parameters);
  EXPECT_EQ(join({"--robot", line}).parameters, first.parameters);
  EXPECT_THAT(join({"--robot", "--operate", line}).problems,
              ElementsAre(HasSubstr("has paired already, without --operate")));
}

TEST_F(PairingStart, TwoOfAKindAreRefused) {
  const std::string for_robot = kLine + std::string{".robot"};
  EXPECT_THAT(join({for_robot}).problems, ElementsAre(HasSubstr("with client --robot")));
  EXPECT_THAT(join({"--robot", kLine}).problems, ElementsAre(HasSubstr("leave out --robot")));
  // A folder stays what it was.
  ASSERT_EQ(join({kLine}).joining->keep(), "");
  EXPECT_THAT(join({"--robot", for_robot}).problems,
              ElementsAre(HasSubstr("is one where the robot is the server: give this one a name")));
  ASSERT_EQ(serve({"--pair", "--drive"}).keep(), "");
  EXPECT_THAT(serve({"--pair"}).problems,
              ElementsAre(HasSubstr("is one where the robot is the client: give this one a name")));
  EXPECT_THAT(serve({"--pair"}, {{"robot", std::string{"client"}}}).problems,
              ElementsAre(HasSubstr("--drive says which end is the robot")));
}

// Else its names would be those of the first.
TEST_F(PairingStart, ASecondRobotNeedsNamesByIdentity) {
  ASSERT_EQ(serve({"--pair", "--drive"}).keep(), "");
  EXPECT_THAT(serve({"--pair", "--drive"}).problems, IsEmpty());  // nobody has paired yet
  TokenEntry robot;
  robot.identity = "robot1";
  ASSERT_EQ(append_token_entry(PairingFolder("/connect_server").file("tokens.yaml"), robot), "");
  EXPECT_THAT(serve({"--pair", "--drive"}).problems,
              ElementsAre(HasSubstr("this server has a robot already")));
  EXPECT_EQ(robot_end({}, {}, "/connect_server"), Role::kClient);
  ASSERT_EQ(serve({"--pair", "--drive"}, {{"prefix", std::string{"by_identity"}}}).keep(), "");
  EXPECT_THAT(serve({"--pair", "--drive"}).problems, IsEmpty());
  const Start second = start_with({{"prefix", std::string{"/robot2"}}},
                                  read_arguments({"--pair", "--drive"}, Role::kServer), "/robot2");
  EXPECT_EQ(second.keep(), "");
  EXPECT_EQ(start_with({}, {}, "/robot2").parameters, second.parameters);
}

TEST_F(PairingStart, ADriversServerIsReachedByARelayToo) {
  const Start first = serve({"--pair", "--drive", "--via", kRelayLine});
  ASSERT_THAT(first.problems, IsEmpty());
  const Start robot = join({"--robot", to_text(*first.invitation)});
  EXPECT_THAT(robot.problems, IsEmpty());
  const Parsed parsed = parse_config(robot.parameters, Role::kClient, {});
  ASSERT_THAT(parsed.problems, IsEmpty());
  EXPECT_EQ(parsed.config->dial.url.robot, "robot7");
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
}

TEST(PairingFolder, IsInTheHomeOfTheUserWhateverTheEnvironmentSays) {
  const char* const home = ::getenv("HOME");
  const std::string before = home ? home : "";
  ::unsetenv("HOME");
  const std::string path = PairingFolder("/robot").path();
  if (home) ::setenv("HOME", before.c_str(), 1);
  EXPECT_EQ(path, std::string(::getpwuid(::geteuid())->pw_dir) + "/.ros/connect_bridge/robot");
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
