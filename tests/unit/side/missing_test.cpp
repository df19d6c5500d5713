// What somebody here wants and does not get, and what a peer is told that asks for it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>

#include "unit/side/action.hpp"
#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

constexpr std::int64_t kSettled = 8000;  // ms after which all is found, asked and said

struct MissingTest : testing::Test {
  explicit MissingTest(std::vector<Rule> rules = {everything()}) : s(server(std::move(rules))) {}
  explicit MissingTest(SideOptions options) : s(std::move(options)) {}

  // "import topic /a not_given: the sentence [the rule]", one per line.
  std::string missing(std::size_t link = 0) {
    std::string lines;
    const Status status = s.status();
    for (const auto& name : status.links.at(link).missing)
      lines += std::string(name.exported ? "export " : "import ") +
               std::string(word_of(kKindWords, name.kind)) + " " + name.name + " " +
               std::string(word_of(kMissingWords, name.reason)) +
               (name.code.empty() ? "" : " by " + name.code) + ": " + name.text +
               (name.rule.empty() ? "" : " [" + name.rule + "]") + "\n";
    return lines;
  }
  // What this side has said of this kind since the last call.
  template <class Message>
  std::vector<Message> heard(std::uint32_t connection) {
    std::vector<Message> all;
    while (const auto packet = s.side.next_packet({connection}, flow_test::now_ms(s.at))) {
      if (!packet->text) continue;
      const Bytes bytes = flow_test::joined(*packet);
      const auto control =
          decode_control({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
      if (const auto* message = control ? std::get_if<Message>(&control.value()) : nullptr)
        all.push_back(*message);
    }
    return all;
  }
  // The names of the questions that the peer was sent since the last call; it answers each of them
  // with `code`.
  std::string asked(const std::string& code, std::uint32_t connection = 1) {
    std::string names;
    for (const auto& ask : heard<Ask>(connection)) {
      Answered answer;
      for (const auto& name : ask.names) {
        names += (names.empty() ? "" : " ") + name.name;
        answer.codes.push_back(code);
      }
      s.say(connection, answer);
    }
    return names;
  }
  // Time passes, and the peer answers what it is asked.
  void settle(const std::string& code = "not_permitted") {
    for (std::int64_t at = 0; at < kSettled; at += 500) {
      s.pass(500);
      asked(code);
    }
  }
  // The codes that this side answers.
  std::string answers(const std::vector<AskedName>& names, std::uint32_t connection = 1) {
    s.side.next_packet({connection}, flow_test::now_ms(s.at));
    s.say(connection, Ask{names});
    std::string codes;
    for (const auto& answer : heard<Answered>(connection)) codes = word_of(answer);
    return codes;
  }
  // Channels from 1 on.
  static Offer offers(const std::vector<std::string>& names) {
    Offer offer;
    for (const std::string& name : names) {
      ChannelOffer& channel = offer.channels.emplace_back();
      channel.channel = {static_cast<std::uint32_t>(offer.channels.size())};
      channel.kind = InterfaceKind::kTopic;
      channel.name = name;
      channel.type = kType;
    }
    return offer;
  }
  std::string logged() {
    s.did();
    return std::exchange(s.logged, {});
  }

  Script s;
};

GraphChanged waited_for(const std::string& name, const std::string& type = kServiceType) {
  GraphChanged graph;
  graph.called = {{name, type}};
  return graph;
}

// ---- what is wanted of the peer

TEST_F(MissingTest, WhatThePeersRulesDoNotGive) {
  s.graph({topic("/a").sub(1)});
  s.join(1);
  settle("not_permitted");
  EXPECT_EQ(missing(),
            "import topic /a not_given: the peer's rules do not export it to this side\n");
  EXPECT_NE(logged().find("1 name that nodes here use is not forwarded to "), std::string::npos);
  settle("not_permitted");
  EXPECT_EQ(logged().find(" not forwarded to "), std::string::npos) << "again";
}

TEST_F(MissingTest, WhatNobodyPublishesThere) {
  s.graph({topic("/a").sub(1)});
  s.join(1);
  settle("absent");
  settle("later");
  EXPECT_EQ(missing(), "import topic /a not_there: nobody publishes it at the peer\n");
  EXPECT_EQ(logged().find(" not forwarded to "), std::string::npos)
      << "that is how it is most of the time";
}

TEST_F(MissingTest, TheOtherAnswers) {
  s.graph({topic("/a").sub(1)});
  s.join(1);
  settle("other_type");
  EXPECT_EQ(missing(), "import topic /a other_type: it has another type at the peer\n");
  settle("type_unknown");
  settle("type_unknown");
  EXPECT_EQ(missing(),
            "import topic /a type_unknown: it exists at the peer, where its type is not "
            "installed\n");
  for (const char* code : {"there", "a_later_version"}) {
    settle(code);
    settle(code);
    EXPECT_EQ(missing(), "") << code;
  }
}

TEST_F(MissingTest, NothingIsSaidBeforeThePeerHasAnswered) {
  s.graph({topic("/a").sub(1)});
  s.join(1);
  s.pass(20'000);
  EXPECT_EQ(missing(), "");
  EXPECT_EQ(asked("absent"), "/a") << "one question at a time";
}

TEST_F(MissingTest, NothingIsSaidInTheFirstSeconds) {
  s.graph({topic("/a").pub(1)});
  s.join(1);
  s.say(1, Accepts{});
  s.pass(5000);
  EXPECT_EQ(missing(), "");
  s.pass(5000);
  EXPECT_EQ(missing(), "export topic /a not_taken: the peer's rules do not import it\n");
}

TEST_F(MissingTest, WhatIsBroughtIsNotMissing) {
  s.graph({topic("/a").sub(1)});
  s.join(1);
  s.offer(1, {channel(1, "/a", {origin(1, 9)})}, true);
  settle();
  EXPECT_EQ(missing(), "");
  s.say(1, Withdraw{{{1}}});
  settle("absent");
  settle("absent");
  EXPECT_EQ(missing(), "import topic /a not_there: nobody publishes it at the peer\n");
}

TEST_F(MissingTest, WhatIsPublishedHereIsNotWantedOfThePeer) {
  s.graph({topic("/a").pub(1).sub(2)});
  s.join(1);
  s.pass(5000);
  EXPECT_EQ(asked("absent"), "");
  settle();
  EXPECT_EQ(missing(), "");
}

TEST_F(MissingTest, AServiceThatIsWaitedFor) {
  s.give(waited_for("/arm"));
  s.join(1);
  settle();
  EXPECT_EQ(missing(), "import service /arm no_rule: no rule here allows it\n");
  s.give(PolicyChanged{Policy({callable()})});
  settle("absent");
  settle("absent");
  EXPECT_EQ(missing(), "import service /arm not_there: nobody serves it at the peer\n");
  EXPECT_NE(logged().find("the service /arm"), std::string::npos);
  s.offer(1, {service_channel(1, "/arm")});
  settle();
  EXPECT_EQ(missing(), "");
}

TEST_F(MissingTest, AnActionIsOneName) {
  GraphChanged graph;
  graph.called = {{"/fib/_action/cancel_goal", "action_msgs/srv/CancelGoal"},
                  {"/fib/_action/get_result", "p/action/Fib_GetResult"},
                  {"/fib/_action/send_goal", "p/action/Fib_SendGoal"}};
  s.give(graph);
  s.join(1);
  settle();
  EXPECT_EQ(missing(), "import action /fib no_rule: no rule here allows it\n");
}

TEST_F(MissingTest, AnotherTypeIsOffered) {
  s.graph({topic("/a").sub(1)});
  s.join(1);
  ChannelOffer offered = channel(1, "/a", {origin(1, 9)});
  offered.type = "p/msg/Other";
  s.offer(1, {offered}, true);
  settle();
  EXPECT_EQ(missing(),
            "import topic /a other_type: it has another type at the peer: p/msg/Other\n");
}

TEST_F(MissingTest, QosThatDoesNotFit) {
  s.graph({topic("/a").sub(1, latched())});
  s.join(1);
  s.offer(1, {channel(1, "/a", {origin(1, 9, best_effort())})}, true);
  settle();
  EXPECT_EQ(
      missing(),
      "import topic /a qos: a subscriber here gets nothing: reliable is requested, best effort "
      "is offered [rule]\n");
}

// ---- what is published here

TEST_F(MissingTest, WhatThePeerDoesNotTake) {
  s.graph({topic("/a").pub(1)});
  s.join(1);
  s.say(1, Accepts{{{{"/a"}, {"p/msg/Other"}}}, {}});
  settle();
  EXPECT_EQ(missing(), "export topic /a not_taken: the peer imports it only as p/msg/Other\n");
  s.say(1, Accepts{{{{"/a"}, {}}}, {}});
  settle();
  EXPECT_EQ(missing(), "");
}

TEST_F(MissingTest, WhatThePeerDeclines) {
  s.graph({topic("/a").pub(1).sub(2)});
  s.join(1);
  s.say(1, Decline{{1}, "type_mismatch", "another definition"});
  settle();
  EXPECT_EQ(missing(),
            "export topic /a declined by type_mismatch: the peer declines it: another definition "
            "[rule]\n");
}

TEST_F(MissingTest, WhatThePeerListensToWithAnotherType) {
  s.graph({typed(topic("/cmd_vel").pub(1), "p/msg/Stamped")});
  s.join(1);
  s.say(1, Listeners{{{{1}, "/cmd_vel", kType, ""}}, {}});
  settle();
  EXPECT_EQ(missing(), "export topic /cmd_vel other_type: the peer subscribes to it as p/msg/T\n");
}

TEST_F(MissingTest, ManyThatNobodyWantsMakeNoNoise) {
  std::vector<Topic> many;
  for (int i = 0; i < 300; ++i)
    many.push_back(topic("/t" + std::to_string(i)).pub(static_cast<std::uint8_t>(1 + i % 200)));
  s.graph(many);
  s.join(1);
  s.say(1, Accepts{});
  settle();
  EXPECT_EQ(missing(), "");
  EXPECT_EQ(s.status().links.at(0).further_missing, 300U);
  EXPECT_EQ(logged().find(" not forwarded to "), std::string::npos);
}

// Somebody who subscribes to a hidden name wants it; who publishes one does not say so.
TEST_F(MissingTest, AHiddenNameThatIsWantedIsNamedWithItsTrap) {
  s.give(PolicyChanged{Policy({rule({"/given/_hidden"}, {"/given/_hidden"})})});
  s.graph({topic("/a/_hidden").sub(1), topic("/b/_hidden").pub(2), topic("/given/_hidden").sub(3)});
  s.join(1);
  s.say(1, Accepts{});
  settle();
  const std::string trap = "; * and ** match no name that begins with _: write it out\n";
  EXPECT_EQ(missing(),
            "import topic /a/_hidden no_rule: no rule here allows it" + trap +
                "import topic /given/_hidden not_given: the peer's rules do not export it "
                "to this side" +
                trap);
}

// A type that is not installed has no subscriber, so nobody here asks for its topic.
TEST_F(MissingTest, ADeclineOfThisSideIsNamed) {
  s.join(1);
  s.say(1, offers({"/scan", "/scan", "not a name"}));
  settle();
  EXPECT_EQ(missing(),
            "import topic /scan declined by limit: declined here: the topic is offered on another "
            "channel\n");
}

TEST_F(MissingTest, NamesOfEveryNodeAreLeftOut) {
  s.graph({topic("/_connect_bridge/x").sub(1),
           typed(topic("/rosout").pub(2), "rcl_interfaces/msg/Log"),
           typed(topic("/parameter_events").pub(3), "rcl_interfaces/msg/ParameterEvent"),
           typed(topic("/diagnostics").pub(5), "diagnostic_msgs/msg/DiagnosticArray"),
           topic("/fib/_action/feedback").sub(4)});
  s.join(1);
  s.say(1, Accepts{});
  s.pass(5000);
  EXPECT_EQ(asked("absent"), "");
  settle();
  EXPECT_EQ(missing(), "");
}

// Every node publishes it, and not what the robot's nodes say.
struct RosoutDenied : MissingTest {
  explicit RosoutDenied(bool at_robot) : MissingTest(denying(at_robot)) {}
  void TestBody() override {}

 private:
  static SideOptions denying(bool at_robot) {
    auto rule = everything();
    rule.deny = {Pattern::parse("/rosout").value()};
    SideOptions options = server({rule});
    options.at_robot = at_robot;
    return options;
  }
};

TEST(Missing, RosoutIsNamedWhereAnOperatorsNodeSubscribes) {
  const auto said = [](bool at_robot, bool subscribed) {
    RosoutDenied test(at_robot);
    auto rosout = topic("/rosout").pub(2);
    if (subscribed) rosout.sub(3);
    test.s.graph({typed(rosout, "rcl_interfaces/msg/Log")});
    test.s.join(1);
    test.settle();
    return test.missing();
  };
  EXPECT_EQ(said(false, true),
            "import topic /rosout denied: the rule rule here denies it (/rosout) [rule]\n");
  EXPECT_EQ(said(false, false), "");
  EXPECT_EQ(said(true, true), "") << "a recorder at the robot";
}

// RViz looks, and has a tool that nobody uses; teleop sends, and a server of the robot may read. A
// panel that looks and drives sends, too.
TEST_F(MissingTest, WhoWaitsForIt) {
  s.graph({topic("/scan").sub(1, {}, "/rviz"), topic("/goal").pub(2, {}, "/rviz"),
           typed(topic("/drive").pub(5, {}, "/rviz"), "geometry_msgs/msg/Twist"),
           topic("/cmd_vel").pub(3, {}, "/teleop"), topic("/clock").sub(4, {}, "/teleop")});
  s.join(1);
  s.say(1, Accepts{});
  settle();
  std::map<std::string, std::string> waits;
  const Status status = s.status();
  for (const auto& name : status.links.at(0).missing)
    waits[name.name] = word_of(kWaitingWords, name.waits);
  EXPECT_EQ(waits["/scan"], "here");
  EXPECT_EQ(waits["/goal"], "nobody");
  EXPECT_EQ(waits["/drive"], "sender");
  EXPECT_EQ(waits["/cmd_vel"], "sender");
}

// A name below a prefix or a namespace is not the one that is asked for.
TEST_F(MissingTest, ASimilarNameIsThere) {
  s.graph({topic("/scan").sub(1)});
  s.join(1);
  Offer offer;
  offer.channels.resize(1);
  offer.channels[0].channel = {1};
  offer.channels[0].kind = InterfaceKind::kTopic;
  offer.channels[0].name = "/robot1/scan";
  offer.channels[0].type = kType;
  s.say(1, offer);
  settle("absent");
  s.pass(500);
  EXPECT_EQ(missing(), "import topic /scan not_there: the peer's has the name /robot1/scan here\n");
}

// The rules do not name what is asked for, because its namespace is wrong.
TEST_F(MissingTest, ASimilarNameIsExported) {
  s.graph({topic("/robot1/scan").sub(1)});
  s.join(1);
  Offer offer;
  offer.channels.resize(1);
  offer.channels[0].channel = {1};
  offer.channels[0].kind = InterfaceKind::kTopic;
  offer.channels[0].name = "/scan";
  offer.channels[0].type = kType;
  s.say(1, offer);
  settle("not_permitted");
  s.pass(500);
  EXPECT_EQ(missing(),
            "import topic /robot1/scan not_given: the peer's rules do not export it to this side; "
            "it exports /scan\n");
}

SideOptions with_prefix() {
  SideOptions options = server({everything()});
  options.names = NameMap("/robot1", {});
  return options;
}

struct MissingWithPrefix : MissingTest {
  MissingWithPrefix() : MissingTest(with_prefix()) {}
};

TEST_F(MissingWithPrefix, ThePeerListensToANameOutsideOfIt) {
  s.graph({topic("/scan").pub(1), topic("/robot1/odom").pub(2)});
  s.join(1);
  s.say(1, Listeners{{{{1}, "/scan", kType, ""}, {{2}, "/odom", kType, ""}}, {}});
  settle();
  EXPECT_EQ(missing(),
            "export topic /scan outside_prefix: the peer listens to it, and only names below "
            "/robot1 (`prefix` of this side) can be exported\n");
}

SideOptions rules_with_prefix() {
  SideOptions options = server({rule({}, {"/robot1/**", "/arm/*"})});
  options.names = NameMap("/robot1", {});
  return options;
}

struct MissingByPrefix : MissingTest {
  MissingByPrefix() : MissingTest(rules_with_prefix()) {}
};

TEST_F(MissingByPrefix, ARuleHasTheNameOfThisGraph) {
  s.graph({topic("/robot1/arm/left/state").sub(2), topic("/robot1/scan").sub(1)});
  s.join(1);
  settle();
  EXPECT_EQ(missing(),
            "import topic /robot1/arm/left/state no_rule: no rule here allows it; in /arm/* (rule "
            "rule) the star is one token, ** is any number of them; rules have names without "
            "`prefix` and `remap`: /arm/left/state\n"
            "import topic /robot1/scan no_rule: no rule here allows it; rules have names without "
            "`prefix` and `remap`: /scan\n");
}

TEST_F(MissingTest, SomebodyAtThePeerWaits) {
  s.graph({typed(topic("/cmd_vel").pub(1), "p/msg/Stamped")});
  s.join(1);
  s.say(1, Listeners{{{{1}, "/cmd_vel", kType, ""}}, {}});
  settle();
  EXPECT_EQ(s.status().links.at(0).missing.at(0).waits, Waiting::kPeer);
}

TEST(BothEnds, SayWhichIsTheRobot) {
  SideOptions options = server({everything()});
  options.robot = "sender";
  Script s(options);
  s.join(1);
  const auto two_of_a_kind = [&](const std::string& peer_says, std::uint32_t number) {
    Accepts accepts;
    accepts.robot = peer_says;
    accepts.message_bytes_max = number;  // another list
    s.say(1, accepts);
    return s.status().links.at(0).two_of_a_kind;
  };
  EXPECT_FALSE(two_of_a_kind("", 1)) << "an older peer";
  EXPECT_FALSE(two_of_a_kind("receiver", 2));
  EXPECT_TRUE(two_of_a_kind("sender", 3));
}

// ---- our own rules

struct MissingNamespace : MissingTest {
  MissingNamespace() : MissingTest({rule({"/scan"}, {})}) {}
};

// The rule has the name that the peer subscribes to; the publisher here is in a namespace.
TEST_F(MissingNamespace, ThePeerListensToATopicThatIsInANamespaceHere) {
  s.graph({topic("/robot1/scan").pub(1), typed(topic("/front/scan").pub(2), "p/msg/Other")});
  s.join(1);
  s.say(1, Listeners{{{{1}, "/scan", kType, ""}}, {}});
  settle();
  EXPECT_EQ(missing(),
            "export topic /robot1/scan no_rule: no rule here allows it; the peer subscribes to "
            "/scan\n"
            "export topic /front/scan no_rule: no rule here allows it\n");
  const Status status = s.status();
  EXPECT_EQ(status.links.at(0).missing.at(0).waits, Waiting::kPeer);
}

struct MissingRulesTest : MissingTest {
  MissingRulesTest() : MissingTest({typed_rule(), other_rule(), denying()}) {}
  static Rule typed_rule() {
    Rule drive = rule({"/cmd_vel"}, {"/pose", "/arm/*"});
    drive.name = "drive";
    drive.types = {"p/msg/Twist"};
    return drive;
  }
  static Rule other_rule() {
    Rule boss = rule({}, {"/secret"});
    boss.name = "boss";
    boss.identities = {"boss"};
    return boss;
  }
  static Rule denying() {
    Rule no = rule({}, {"/camera/**"}, {"/camera/raw"});
    no.name = "no";
    return no;
  }
};

TEST_F(MissingRulesTest, TheRuleThatDecidesIsNamed) {
  s.graph({topic("/camera/raw").sub(1), topic("/cmd_vel").pub(2), topic("/pose").sub(3),
           topic("/secret").sub(4), topic("/unknown").sub(5), topic("/arm/left/state").sub(6)});
  s.join(1);
  settle();
  EXPECT_EQ(missing(),
            "import topic /arm/left/state no_rule: no rule here allows it; in /arm/* (rule drive) "
            "the star is one token, ** is any number of them\n"
            "import topic /camera/raw denied: the rule no here denies it (/camera/raw) [no]\n"
            "import topic /pose rule_type: the rule drive here is only for p/msg/Twist [drive]\n"
            "import topic /secret other_peer: the rule boss here is for other peers (boss), "
            "and this one is nobody [boss]\n"
            "import topic /unknown no_rule: no rule here allows it\n"
            "export topic /cmd_vel rule_type: the rule drive here is only for p/msg/Twist "
            "[drive]\n");
  EXPECT_NE(logged().find("6 names that nodes here use are not forwarded"), std::string::npos);
}

// ---- questions of the peer

AskedName asks(const std::string& name, const std::string& type = kType,
               InterfaceKind kind = InterfaceKind::kTopic) {
  return {kind, name, type};
}

// ---- findings

std::string text_of(const std::vector<PeerFinding>& findings) {
  std::string text;
  for (const PeerFinding& one : findings) text += one.id + " " + one.name + "\n";
  return text;
}

TEST_F(MissingTest, FindingsAreSentWhenTheyChange) {
  s.join(1);
  Accepts takes_findings;
  takes_findings.findings = true;
  s.say(1, takes_findings);
  s.say(1, offers({"/a"}));
  const auto said = [&](std::vector<PeerFinding> findings) {
    s.give(FindingsMade{{{LinkId{s.status().links.at(0).number}, std::move(findings)}}});
    std::string all;
    for (const Findings& one : heard<Findings>(1)) all += "now\n" + text_of(one.list);
    return all;
  };
  EXPECT_EQ(said({}), "");
  EXPECT_EQ(said({{"qos", "/a"}, {"qos", "/not_offered"}, {"path_full", ""}}),
            "now\nqos /a\npath_full \n");
  EXPECT_EQ(said({{"qos", "/a"}, {"path_full", ""}}), "");
  EXPECT_EQ(said({}), "now\n");
  const std::vector<PeerFinding> many(kFindingsMax + 1, {"qos", "/a"});
  heard<Findings>(1);
  s.give(FindingsMade{{{LinkId{s.status().links.at(0).number}, many}}});
  const auto sent = heard<Findings>(1);
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_EQ(sent[0].list.size(), kFindingsMax);
}

// They are for people, so a name that is none, or that does not cross the link, is left out.
TEST_F(MissingTest, FindingsOfThePeerAreThoseOfItsConnection) {
  s.join(1);
  const auto known = [&] { return text_of(s.status().links.at(0).peer_findings); };
  s.say(1, offers({"/scan", "/odom"}));
  s.say(1,
        Findings{
            {{"qos", "/scan"}, {"path_full", ""}, {"qos", "not a name"}, {"qos", "/elsewhere"}}});
  EXPECT_EQ(known(), "qos /scan\npath_full \n");
  s.say(1, Findings{{{"qos", "/odom"}}});
  EXPECT_EQ(known(), "qos /odom\n");
  s.give(ConnectionClosed{{1}, 1006, ""});
  EXPECT_EQ(known(), "");
}

TEST_F(MissingTest, AQuestionIsAnsweredByTheRulesFirst) {
  s.give(PolicyChanged{Policy({rule({"/given/**"}, {})})});
  s.graph({topic("/given/a").pub(1), topic("/kept/a").pub(2),
           typed(topic("/given/b").pub(3), "p/msg/Other"), topic("/given/c").sub(4)});
  s.join(1);
  EXPECT_EQ(answers({asks("/given/a"), asks("/kept/a"), asks("/kept/nothing"), asks("/given/b"),
                     asks("/given/c"), asks("/given/nothing"), asks("not a name"),
                     asks("/given/_hidden"), asks("/given/a", "x", InterfaceKind::kOther)}),
            "answer there not_permitted not_permitted other_type absent absent not_permitted "
            "not_permitted unsupported");
}

TEST_F(MissingTest, WithTypesARuleSaysNothingOfOthers) {
  Rule twist = rule({"/cmd_vel"}, {});
  twist.types = {"p/msg/Twist"};
  s.give(PolicyChanged{Policy({twist})});
  s.graph({typed(topic("/cmd_vel").pub(1), "p/msg/Stamped")});
  s.join(1);
  EXPECT_EQ(answers({asks("/cmd_vel", "p/msg/Stamped"), asks("/cmd_vel", "p/msg/Twist")}),
            "answer not_permitted absent");
}

TEST_F(MissingTest, ServicesAndActionsAreAnswered) {
  s.give(PolicyChanged{Policy({acting()})});
  serve_action(s);
  s.join(1);
  const auto service = InterfaceKind::kService;
  EXPECT_EQ(answers({asks("/fib/_action/send_goal", "p/action/Fib_SendGoal", service),
                     asks("/fob/_action/send_goal", "p/action/Fib_SendGoal", service),
                     asks("/s", kServiceType, service)}),
            "answer there absent absent");
}

TEST_F(MissingTest, QuestionsWithoutEndEndTheLink) {
  s.join(1);
  for (int i = 0; i < 16; ++i) s.say(1, Ask{{asks("/a")}});
  EXPECT_EQ(s.did(), "");
  s.say(1, Ask{{asks("/a")}});
  EXPECT_EQ(s.did(), "close 1 4006\n");
}

// However many links its identity has.
TEST_F(MissingTest, QuestionsOfAnIdentityAreAnsweredAtAPace) {
  for (std::uint32_t link = 1; link <= 5; ++link) s.join(link);
  for (std::uint32_t i = 0; i < 64; ++i) s.say(1 + i / 16, Ask{{asks("/a")}});
  EXPECT_EQ(answers({asks("/a"), asks("/b")}, 5), "answer later later");
}

TEST_F(MissingTest, AnAnswerThatNobodyAskedForEndsTheLink) {
  s.join(1);
  s.say(1, Answered{{"absent"}});
  EXPECT_EQ(s.did(), "close 1 4009\n");
}

TEST_F(MissingTest, AnAnswerOfAnotherLengthEndsTheLink) {
  s.graph({topic("/a").sub(1)});
  s.join(1);
  s.did();
  s.pass(5000);
  s.did();
  s.say(1, Answered{{"absent", "absent"}});
  EXPECT_EQ(s.did(), "close 1 4009\n");
}

TEST_F(MissingTest, NoMoreIsAskedThanTheLimit) {
  std::vector<Topic> many;
  for (int i = 0; i < 300; ++i) many.push_back(topic("/t" + std::to_string(i)).sub(7));
  s.graph(many);
  s.join(1);
  std::set<std::string> all;
  for (int i = 0; i < 20; ++i) {
    s.pass(1000);
    const std::string names = asked("not_permitted");
    EXPECT_LE(std::count(names.begin(), names.end(), ' '), 63);
    for (std::size_t at = 0; at < names.size();) {
      const auto end = std::min(names.find(' ', at), names.size());
      all.insert(names.substr(at, end - at));
      at = end + 1;
    }
  }
  EXPECT_EQ(all.size(), 128U);
  EXPECT_EQ(s.status().links.at(0).missing.size(), MissingName::kMissingMax);
  EXPECT_GE(s.status().links.at(0).further_missing, 64U);
}

}  // namespace
}  // namespace connect_bridge::side_test
