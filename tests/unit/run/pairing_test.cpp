#include "run/pairing.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

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

TEST(Invitation, IsReadAsItWasWritten) {
  std::string problem;
  const Invitation read = parse_invitation(kLine, problem);
  EXPECT_EQ(problem, "");
  EXPECT_EQ(read.url, "wss://robot.local:9090/");
  EXPECT_EQ(read.code, "00112233445566778899aabbccddeeff");
  EXPECT_EQ(read.pin, "47DEQpj8HBSa+/TImW+5JCeuQeRkm5NMpJWZG3hSuFU=");
  EXPECT_EQ(to_text(read), kLine);
}

TEST(Invitation, APartOfOneIsRefusedWithoutTheCode) {
  const std::string line = kLine;
  for (const std::string& wrong :
       {std::string{}, std::string{"wss"}, std::string{"wss+pair://"},
        std::string{"wss+pair://robot.local:9090/"}, line.substr(0, line.size() - 1), line + "A",
        std::string{"wss+pair://a b/"} + line.substr(28),
        std::string{"wss+pair://user:word@robot/"} + line.substr(28)}) {
    std::string problem;
    static_cast<void>(parse_invitation(wrong, problem));
    EXPECT_THAT(problem, HasSubstr("the invitation is not complete")) << wrong;
    EXPECT_THAT(problem, testing::Not(HasSubstr("0011"))) << wrong;
  }
}

TEST(Invitation, ARelaysLineIsReadAsItWasWritten) {
  const std::string line = "wss+relay://robot7@relay.example:443/#" + std::string(64, 'a') +
                           ".47DEQpj8HBSa-_TImW-5JCeuQeRkm5NMpJWZG3hSuFU";
  std::string problem;
  const Invitation read = parse_relay_line(line, problem);
  EXPECT_EQ(problem, "");
  EXPECT_EQ(read.url, "wss://robot7@relay.example:443/");
  EXPECT_EQ(to_relay_line(read), line);
  std::string nobody = line;
  for (const std::string& wrong : {line + "A", nobody.replace(12, 7, ""), std::string{kLine}}) {
    problem.clear();
    static_cast<void>(parse_relay_line(wrong, problem));
    EXPECT_THAT(problem, HasSubstr("the relay's line is not complete")) << wrong;
  }
}

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

// Each further try costs the server one of ten.
TEST(Invitation, ARefusedOneIsNotShownAgain) {
  EXPECT_THAT(refused_invitation(4003), HasSubstr("the server refused the invitation"));
  for (const std::uint16_t code : {1001, 4004, 4012, 4013, 4015, 4016})
    EXPECT_EQ(refused_invitation(code), "") << code;
  EXPECT_EQ(refused_invitation(std::nullopt), "");
}

TEST(Arguments, OthersAreRefusedWithoutTheirValue) {
  const Arguments read = read_arguments({"--pair", "--x", "auth.token:=secret"}, Role::kServer);
  EXPECT_TRUE(read.pairs);
  EXPECT_EQ(read.host, "");
  EXPECT_THAT(read.problems, ElementsAre(HasSubstr("\"--x\""), HasSubstr("\"auth.token\"")));
  EXPECT_EQ(read_arguments({"--pair", "robot.example"}, Role::kServer).host, "robot.example");
  EXPECT_TRUE(read_arguments({"--pair", "--operate"}, Role::kServer).operates);
  EXPECT_THAT(read_arguments({"--operate"}, Role::kServer).problems,
              ElementsAre(HasSubstr("give --pair")));
  EXPECT_THAT(read_arguments({"--pair"}, Role::kClient).problems, SizeIs(1));
  EXPECT_THAT(read_arguments({kLine}, Role::kServer).problems, SizeIs(1));
}

TEST_F(PairingStart, AServerStartsTheSameWayLater) {
  const Start first = serve({"--pair", "robot.local"}, {{"listen.port", std::int64_t{9443}}});
  ASSERT_THAT(first.problems, IsEmpty());
  ASSERT_TRUE(first.invitation);
  EXPECT_THAT(first.news, ElementsAre(HasSubstr("params.yaml")));
  EXPECT_THAT(parse_config(first.parameters, Role::kServer, {}).problems, IsEmpty());
  EXPECT_THAT(serve({}).parameters, IsEmpty());  // nothing stays of what may not even start
  EXPECT_EQ(first.keep(), "");
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
  const std::string line = "wss+relay://robot7@relay.example:443/#" + std::string(64, 'a') +
                           ".47DEQpj8HBSa-_TImW-5JCeuQeRkm5NMpJWZG3hSuFU";
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
  EXPECT_THAT(serve({"--via", line}).problems, ElementsAre(HasSubstr("give --pair")));
  EXPECT_THAT(serve({"--pair", "host", "--via", line}).problems, SizeIs(1));
  // The client verifies the robot's key.
  const Start client = join({to_text(*first.invitation)});
  EXPECT_THAT(parse_config(client.parameters, Role::kClient, {}).problems, IsEmpty());
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
