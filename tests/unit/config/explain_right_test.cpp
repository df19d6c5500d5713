// `ctl explain`: its text, and that this agrees with the policy.
#include "config/explain_right.hpp"

#include <gmock/gmock.h>

#include "yaml_parameters.hpp"

namespace connect_bridge {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr char kRules[] = R"(
rules: [drive, look, tune, shut, late]
rule:
  drive:
    import_topics: [/cmd_vel]
    types: [geometry_msgs/msg/Twist]
    identities: [ops]
    groups: [crew]
  look: {export_topics: ["/camera/**", /tf]}
  tune: {parameters: [/controller], export_services: ["/map/*"], export_actions: [/go]}
  shut: {deny: ["/camera/secret/**", "/**/set_parameters*"]}
  late: {export_topics: ["/**"], identities: [anna]}
)";

Config server_config() {
  return config_of(yaml(kRules), Role::kServer);
}

RightQuestion topic(std::string name, Direction direction, std::string who = "ops") {
  RightQuestion question;
  question.name = std::move(name);
  question.direction = direction;
  question.who.name = std::move(who);
  return question;
}

std::string said(const RightQuestion& question) {
  return explain_right(server_config(), question).text;
}

TEST(ExplainRight, TheRuleThatDecides) {
  auto question = topic("/cmd_vel", Direction::kImport);
  question.type = "geometry_msgs/msg/Twist";
  const std::string text = said(question);
  EXPECT_THAT(text, HasSubstr("import (the topic of the peer, here), /cmd_vel: allowed\n"));
  EXPECT_THAT(text,
              HasSubstr("allowed by rule \"drive\" (rule.drive.import_topics: \"/cmd_vel\")"));
  EXPECT_THAT(text, HasSubstr("the peer's rules must have it in export_topics; those of a client "
                              "without rules do\n"));
  question.type = "p/msg/Other";
  EXPECT_THAT(said(question), HasSubstr("/cmd_vel: not allowed\n"));
  EXPECT_THAT(said(question), HasSubstr("matches, but is only for the types"));
  EXPECT_THAT(said(question), Not(HasSubstr("no rule in use")));
}

TEST(ExplainRight, AKeyThatARuleHasIsNotDenied) {
  Config config = config_of(yaml("{rules: [look], rule: {look: {export_topics: [/scan, /tf]}}}"),
                            Role::kServer);
  const std::string text = explain_right(config, topic("/rosout", Direction::kExport)).text;
  EXPECT_THAT(text, HasSubstr("no rule in use names it in export_topics"));
  EXPECT_THAT(explain_right(config, topic("/rosout", Direction::kImport)).text,
              HasSubstr("no rule in use has import_topics"));
}

// Nothing of a Twist is ever video.
TEST(ExplainRight, TheTypesOfARuleSayWhetherItMayBeLossy) {
  const auto of_types = [](const std::string& types) {
    Config config =
        config_of(yaml("{rules: [a], rule: {a: {export_topics: [/t], types: [" + types + "]}}}"),
                  Role::kServer);
    return explain_right(config, topic("/t", Direction::kExport)).text;
  };
  EXPECT_THAT(of_types("geometry_msgs/msg/Twist"), Not(HasSubstr("exact")));
  EXPECT_THAT(of_types("geometry_msgs/msg/Twist, nav_msgs/msg/Path"), Not(HasSubstr("exact")));
  EXPECT_THAT(of_types("sensor_msgs/msg/PointCloud2"), HasSubstr("(rounded points)"));
  EXPECT_THAT(of_types("geometry_msgs/msg/Twist, sensor_msgs/msg/Image"), HasSubstr("exact"));
}

TEST(ExplainRight, ForWhom) {
  const auto text = said(topic("/cmd_vel", Direction::kImport, "anna"));
  EXPECT_THAT(text, HasSubstr("/cmd_vel: not allowed\n"));
  EXPECT_THAT(text, HasSubstr(R"(is only for identities ["ops"] or groups ["crew"])"));
  auto crew = topic("/cmd_vel", Direction::kImport, "bert");
  crew.who.groups = {"crew"};
  EXPECT_THAT(said(crew), HasSubstr("allowed for some types"));
  EXPECT_THAT(said(crew), HasSubstr(R"(if its type is one of ["geometry_msgs/msg/Twist"])"));
}

TEST(ExplainRight, ADenyWins) {
  const auto text = said(topic("/camera/secret/a", Direction::kExport));
  EXPECT_THAT(text, HasSubstr("/camera/secret/a: not allowed\n"));
  EXPECT_THAT(text, HasSubstr("denied by rule \"shut\" (rule.shut.deny: \"/camera/secret/**\")"));
  EXPECT_THAT(text, HasSubstr("would be allowed by rule \"look\""));
}

TEST(ExplainRight, WhatComesLater) {
  const auto text = said(topic("/tf", Direction::kExport, "anna"));
  EXPECT_THAT(text, HasSubstr("allowed by rule \"look\""));
  EXPECT_THAT(text, HasSubstr("rule \"late\" (rule.late.export_topics: \"/**\") matches, too"));
}

TEST(ExplainRight, TheNearest) {
  EXPECT_THAT(said(topic("/cmd_vle", Direction::kImport)),
              HasSubstr("the nearest is rule \"drive\" (rule.drive.import_topics: \"/cmd_vel\")"));
  EXPECT_THAT(said(topic("/cmd_vel", Direction::kExport)),
              HasSubstr("rule \"drive\" (rule.drive.import_topics: \"/cmd_vel\") matches the name, "
                        "but is for the other direction"));
  EXPECT_THAT(said(topic("/odometry", Direction::kImport)), Not(HasSubstr("the nearest is")));
  RightQuestion question = topic("/_hidden", Direction::kImport);
  question.what = OpenedBy::kServices;
  EXPECT_THAT(said(question), HasSubstr("no rule in use has import_services"));
}

TEST(ExplainRight, ServicesActionsAndParameters) {
  RightQuestion question = topic("/map/load", Direction::kExport);
  question.what = OpenedBy::kServices;
  EXPECT_THAT(said(question), HasSubstr("/map/load: allowed\n"));
  question.what = OpenedBy::kActions;
  question.name = "/go";
  EXPECT_THAT(said(question), HasSubstr("/go: allowed\n"));
  question.what = OpenedBy::kParameters;
  question.name = "/controller";
  const auto text = said(question);
  EXPECT_THAT(text, HasSubstr("allowed by rule \"tune\" (rule.tune.export_parameters"));
  EXPECT_THAT(text, HasSubstr("but not set_parameters: denied by rule \"shut\""));
  EXPECT_THAT(text, Not(HasSubstr("but not get_parameters:")));
}

TEST(ExplainRight, ParametersAreOpenAsLongAsOneServiceIs) {
  RightQuestion question;
  question.what = OpenedBy::kParameters;
  question.name = "/nav";
  const std::string open = "rules: [a, b]\nrule: {a: {export_parameters: [/nav]}, b: {deny: [";
  const auto explained = [&](const std::string& deny) {
    return explain_right(config_of(yaml((open + deny + "]}}").c_str()), Role::kServer), question)
        .text;
  };
  const auto some = explained("\"/**/get_parameters\"");
  EXPECT_THAT(some, HasSubstr("/nav: allowed\n"));
  EXPECT_THAT(some, HasSubstr("but not get_parameters: denied by rule \"b\""));
  EXPECT_THAT(explained("\"/nav/**\""), HasSubstr("/nav: not allowed\n"));
}

TEST(ExplainRight, WhatIsNoName) {
  RightQuestion question = topic("cmd_vel", Direction::kImport);
  EXPECT_THAT(problem_of(question), HasSubstr("an absolute name"));
  question.name = "/a/_action/feedback";
  EXPECT_THAT(problem_of(question), HasSubstr("--action"));
  question.name = "/parameter_events";
  EXPECT_THAT(problem_of(question), HasSubstr("--parameters"));
  question.name = "/a";
  question.type = "std_srvs/srv/SetBool";
  EXPECT_THAT(problem_of(question), HasSubstr("std_msgs/msg/String"));
}

TEST(ExplainRight, AClientWithoutRules) {
  const Config config = config_of({{"url", "wss://robot.example/"}}, Role::kClient);
  const auto text = explain_right(config, topic("/scan", Direction::kImport)).text;
  EXPECT_THAT(text, HasSubstr("allowed by the default rules ("));
  EXPECT_THAT(text, Not(HasSubstr("rule.default")));
}

TEST(ExplainRight, ARobotThatDials) {
  const std::string rules = "url: 'wss://desk.example/'\nrobot: client\nrules: [a]\n";
  const Config config =
      config_of(yaml(rules + "rule: {a: {export_topics: [/scan]}}"), Role::kClient);
  EXPECT_THAT(explain_right(config, topic("/scan", Direction::kExport)).text,
              HasSubstr("; those of a server without rules do\n"));
}

// They deny /rosout, and let a server call nothing.
TEST(ExplainRight, WhatTheDefaultRulesOfTheClientHave) {
  const auto said_of = [](const char* rule, OpenedBy what, const char* name, Direction direction) {
    RightQuestion question = topic(name, direction);
    question.what = what;
    const std::string rules = std::string("rules: [a]\nrule: {a: {") + rule + ": [\"/**\"]}}";
    return explain_right(config_of(yaml(rules), Role::kServer), question).text;
  };
  const std::string not_so = "; those of a client without rules do not\n";
  EXPECT_THAT(said_of("export_topics", OpenedBy::kTopics, "/rosout", Direction::kExport),
              HasSubstr("have it in import_topics" + not_so));
  EXPECT_THAT(said_of("export_topics", OpenedBy::kTopics, "/scan", Direction::kExport),
              HasSubstr("; those of a client without rules do\n"));
  EXPECT_THAT(said_of("import_topics", OpenedBy::kTopics, "/rosout", Direction::kImport),
              HasSubstr(not_so));
  EXPECT_THAT(said_of("import_services", OpenedBy::kServices, "/s", Direction::kImport),
              HasSubstr(not_so));
  EXPECT_THAT(said_of("export_actions", OpenedBy::kActions, "/go", Direction::kExport),
              HasSubstr("; those of a client without rules do\n"));
}

TEST(ExplainRight, WhatIsAllowedInEachDirectionAskedForOrForSomeTypesIsAllowed) {
  const auto allowed = [](const RightQuestion& question) {
    return explain_right(server_config(), question).allowed;
  };
  RightQuestion question = topic("/cmd_vel", Direction::kImport);
  EXPECT_TRUE(allowed(question)) << "for some types";
  question.type = "p/msg/Other";
  EXPECT_FALSE(allowed(question));
  question = topic("/tf", Direction::kExport);
  EXPECT_TRUE(allowed(question));
  question.direction = Direction::kImport;
  EXPECT_FALSE(allowed(question));
  question.direction.reset();
  EXPECT_FALSE(allowed(question)) << "only in one of both";
  EXPECT_FALSE(allowed(topic("/camera/secret/a", Direction::kExport))) << "denied";
}

// The text agrees with the policy for every question.
TEST(ExplainRight, SaysWhatThePolicyDoes) {
  const Config config = server_config();
  for (const char* name : {"/cmd_vel", "/tf", "/camera/a", "/camera/secret/a", "/map/a", "/_x/a"})
    for (const Direction direction : {Direction::kExport, Direction::kImport})
      for (const char* who : {"ops", "anna", ""})
        for (const char* type : {"geometry_msgs/msg/Twist", "p/msg/T"}) {
          auto question = topic(name, direction, who);
          question.type = type;
          const bool allowed =
              config.policy.decide(direction, InterfaceKind::kTopic, name, type, question.who)
                  .has_value();
          const RightAnswer answer = explain_right(config, question);
          EXPECT_EQ(answer.text.find(": allowed\n") != std::string::npos, allowed)
              << name << " " << who << " " << type;
          EXPECT_EQ(answer.allowed, allowed) << name << " " << who << " " << type;
        }
}

// A person whose program measures in pictures has to find the key.
TEST(ExplainRight, WhichRuleForbidsThatPicturesLoseSomething) {
  constexpr char kLossy[] = R"(
rules: [measured, kept, seen]
rule:
  measured: {export_topics: [/measured], lossy: never}
  kept: {export_topics: [/kept], import_topics: [/kept], keep: all}
  seen: {export_topics: ["/**"]}
)";
  bool video = true;
  const auto answer = [&](const char* name, const char* type,
                          Direction direction = Direction::kExport) {
    auto question = topic(name, direction);
    question.type = type;
    question.video = video;
    return explain_right(config_of(yaml(kLossy), Role::kServer), question).text;
  };
  constexpr char kImage[] = "sensor_msgs/msg/Image";
  EXPECT_THAT(answer("/measured", kImage),
              HasSubstr("  every message is exact by \"rule.measured.lossy: never\"\n"));
  EXPECT_THAT(answer("/kept", kImage), HasSubstr("exact by \"rule.kept.keep: all\"\n"));
  EXPECT_THAT(answer("/kept", kImage, Direction::kImport), Not(HasSubstr("exact by")));
  EXPECT_THAT(answer("/camera", kImage),
              HasSubstr("  not exact where the link would carry too few exact ones (video); "
                        "\"rule.seen.lossy: never\" forbids it\n"));
  EXPECT_THAT(answer("/camera", "sensor_msgs/msg/CompressedImage"), HasSubstr("(video)"));
  EXPECT_THAT(answer("/points", "sensor_msgs/msg/PointCloud2"), HasSubstr("(rounded points)"));
  EXPECT_THAT(answer("/any", ""), HasSubstr("(a picture as video, a PointCloud2 rounded)"));
  EXPECT_THAT(answer("/text", "std_msgs/msg/String"), Not(HasSubstr("exact")));
  video = false;
  EXPECT_THAT(answer("/camera", kImage),
              HasSubstr("  every message is exact: this build has no video\n"));
  EXPECT_THAT(answer("/points", "sensor_msgs/msg/PointCloud2"), HasSubstr("(rounded points)"));
  EXPECT_THAT(answer("/any", ""), HasSubstr("(a PointCloud2 rounded; this build has no video)"));
}

}  // namespace
}  // namespace connect_bridge
