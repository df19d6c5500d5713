#include "ops/status/status_screen.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <sstream>
#include <string>

namespace connect_bridge {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

Json status(int second, int messages, const std::string& name = "/scan") {
  Json topic = {{"topic", name},
                {"type", "sensor_msgs/msg/LaserScan"},
                {"direction", "export"},
                {"demanded", true},
                {"state", "flows"},
                {"origins", 1},
                {"messages", messages},
                {"published", messages},
                {"wire_bytes", messages * 1000},
                {"queued", 2},
                {"latency_ms", 12.4},
                {"dropped", {{"rate", 3}}}};
  Json goals = {{"service", "/dock/_action/get_result"},
                {"direction", "import"},
                {"state", "ready"},
                {"pending", 1},
                {"calls", 4},
                {"answered", 3},
                {"lost", 1}};
  Json link = {{"link", 7},
               {"node", "/robot"},
               {"identity", "anna"},
               {"open", true},
               {"state", "open"},
               {"open_seconds", 130},
               {"clock", {{"round_trip_ms", 2.5}}},
               {"topics", {topic}},
               {"services", {goals}}};
  return {{"time", "2026-01-31T12:00:0" + std::to_string(second) + ".500Z"},
          {"node", "/connect_client"},
          {"role", "client"},
          {"links", {link}}};
}

TEST(StatusScreen, RatesAndStates) {
  const std::string screen = status_screen(status(3, 40), status(1, 20), {100});
  EXPECT_THAT(screen, AllOf(HasSubstr("/connect_client (client)  1 link open\n"),
                            HasSubstr("link 7  anna /robot"), HasSubstr("open for 2 min"),
                            HasSubstr("round trip 2.5 ms"), HasSubstr("/dock (action)"),
                            Not(HasSubstr("\x1b"))));
  EXPECT_THAT(screen,
              testing::ContainsRegex(
                  "/scan +export +10 +10 kB/s +2 +12 ms +3 above the rule's rate +flows\n"));
  EXPECT_THAT(screen, testing::ContainsRegex("import +1 +4 +3 +1 lost +ready\n"));
  EXPECT_THAT(status_screen(status(3, 40), nullptr, {100}), Not(HasSubstr("10 kB")));
}

// Never "flows" while nine of ten are replaced.
TEST(StatusScreen, AnOverloadIsShown) {
  Json before = status(1, 0), now = status(3, 2);
  Json& topic = now["links"][0]["topics"][0];
  topic["published"] = 20;
  topic["state"] = "overloaded";
  const std::string screen = status_screen(now, before, {100});
  EXPECT_THAT(screen, AllOf(HasSubstr("carries less than is published on /scan\n"),
                            testing::ContainsRegex("/scan +export +1.0 of 10 .*overloaded\n")));
  EXPECT_THAT(status_screen(now, before, {100, 0, true}), HasSubstr("\x1b[33moverloaded\x1b[0m"));
}

// The core calls a stream overloaded whose messages wait; of a picture only the newest waits.
TEST(StatusScreen, FlowsInPartWhereHalfIsDropped) {
  Json before = status(1, 0), now = status(3, 20);
  Json& topic = now["links"][0]["topics"][0];
  topic["published"] = 40;
  topic["dropped"] = {{"newer_available", 20}};
  EXPECT_THAT(status_screen(now, before, {100, 0, true}),
              HasSubstr("\x1b[33mflows in part\x1b[0m"));
  topic["dropped"] = {{"rate", 23}};  // by a rule
  EXPECT_THAT(status_screen(now, before, {100}), Not(HasSubstr("in part")));
}

TEST(StatusScreen, WhatIsNotExactIsMarked) {
  Json now = status(1, 0);
  EXPECT_THAT(status_screen(now, nullptr, {100}), Not(HasSubstr("~")));
  now["links"][0]["topics"][0]["not_exact"] = "video, fair";
  const std::string screen = status_screen(now, nullptr, {100});
  EXPECT_THAT(screen, AllOf(HasSubstr("~ not exact: /scan (video, fair)\n"),
                            testing::ContainsRegex("/scan .* ~ flows\n")));
}

// A terminal has 80 columns; a name and a reason are whole all the same.
TEST(StatusScreen, NoLineIsLongerThanTheTerminal) {
  Json now =
      status(3, 40, "/factory/line_0/station_12/vibration_spectrum/of_the_left_arm_of_the_press");
  Json& link = now["links"][0];
  link["topics"].push_back(status(3, 2)["links"][0]["topics"][0]);
  link["topics"][1]["declined"] =
      "the type acme_msgs/msg/Telemetry is not installed at the other side";
  link["topics"][1]["state"] = "declined";
  link["breaks"] = Json::parse(R"([{"lost": "2026-01-31T11:00:00.000Z", "seconds": 3.5,
    "back": "2026-01-31T11:00:03.500Z", "reason": "no answer for a time that is really long"}])");
  link["peer"] = "203.0.113.5:40000";
  now["node"] = "/factory/line_0/station_12/left_arm_of_the_press/connect_server";
  now["audit"] = {{"problem", "/var/log/audit.jsonl: No space left on device"}};
  now["refused_parameters"] = {{"time", "2026-01-31T11:00:00.000Z"},
                               {"problem", "rule.drive.max_agee is unknown"}};
  now["relays"] = Json::parse(R"([{"relay": "wss://r@relay", "connected": false,
                                   "last_failure": "no answer"}])");
  now["needs_restart"] = {"prefix", "url"};
  const std::string screen = status_screen(now, status(1, 0), {100, 80});
  std::istringstream lines(screen);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 80U) << line;
  EXPECT_THAT(screen,
              AllOf(HasSubstr("/of_the_left_arm_of_the_press\n"), HasSubstr("not installed"),
                    HasSubstr("1 break, the last at 11:00:00 UTC, for 3 s: no answer"),
                    HasSubstr("No space left on device"), HasSubstr("max_agee"),
                    HasSubstr("needs a restart: url"),
                    HasSubstr("no connection to the relay wss://r@relay: no answer")));
}

// A program that was killed again and again leaves a link each time.
TEST(StatusScreen, LostLinksOfOneProgramAreOneLine) {
  Json now = status(3, 40);
  Json lost = now["links"][0];
  lost["open"] = false;
  lost["state"] = "lost";
  lost["peer"] = "10.0.0.7:4001";
  lost["breaks"] = {{{"lost", "2026-01-31T11:59:00.000Z"}, {"code", "connection_lost"}}};
  lost["topics"][0]["topic"] = "/ghost";
  now["links"].push_back(lost);
  EXPECT_THAT(status_screen(now, nullptr, {100}), AllOf(HasSubstr("/ghost"), HasSubstr("link 7")))
      << "one may return";
  lost["link"] = 8;
  lost["peer"] = "10.0.0.7:4002";
  now["links"].push_back(lost);
  EXPECT_THAT(
      status_screen(now, nullptr, {100}),
      AllOf(HasSubstr("1 link open, 2 lost"), Not(HasSubstr("/ghost")), HasSubstr("/scan"),
            HasSubstr("2 links  anna /robot 10.0.0.7  lost, the last since 11:59:00 UTC\n")));
  now["links"][2]["identity"] = "ben";
  EXPECT_THAT(status_screen(now, nullptr, {100}), HasSubstr("/ghost")) << "two people";
}

// A graph of six parameter services for each node shows little else.
TEST(StatusScreen, ActionsAndParameterServicesAreOneRowEach) {
  Json now = status(1, 0);
  Json& link = now["links"][0];
  const auto service = [&](const std::string& name, int calls) {
    link["services"].push_back(
        {{"service", name}, {"direction", "import"}, {"state", "ready"}, {"calls", calls}});
  };
  for (const char* part : {"send_goal", "cancel_goal"})
    service(std::string("/dock/_action/") + part, 9);
  for (const char* part : {"get_parameters", "set_parameters", "list_parameters"})
    service(std::string("/arm/") + part, 2);
  Json feedback = link["topics"][0];
  feedback["topic"] = "/dock/_action/feedback";
  feedback["direction"] = "import";
  feedback["state"] = "overloaded";
  link["topics"].push_back(feedback);
  const std::string screen = status_screen(now, nullptr, {100});
  EXPECT_THAT(screen, AllOf(testing::ContainsRegex("/dock \\(action\\) +import +1 +4 +3 +"
                                                   "3 feedback dropped, 1 lost +overloaded\n"),
                            testing::ContainsRegex("/arm \\(parameters\\) +import +6 +ready\n"),
                            HasSubstr("carries less than is published on /dock (action)\n"),
                            Not(HasSubstr("_action")), Not(HasSubstr("get_parameters"))));
}

TEST(StatusScreen, WhatIsMissingAndWhy) {
  Json now = status(1, 0);
  EXPECT_THAT(status_screen(now, nullptr, {9}), Not(HasSubstr("NOT FORWARDED")));
  now["links"][0]["missing"] = Json::parse(R"([{"kind": "topic", "name": "/cmd_vel",
    "direction": "export", "reason": "not_taken", "text": "the peer takes it only as a Twist"}])");
  EXPECT_THAT(
      status_screen(now, nullptr, {9}),
      testing::ContainsRegex("/cmd_vel +topic +export +the peer takes it only as a Twist\n"));
}

TEST(StatusScreen, TheParametersOfANodeLackInOneRow) {
  Json now = status(1, 0);
  for (const char* part : {"get_parameters", "set_parameters", "list_parameters"})
    now["links"][0]["missing"].push_back({{"kind", "service"},
                                          {"name", std::string("/arm/") + part},
                                          {"direction", "import"},
                                          {"text", "no rule here allows it"}});
  const std::string screen = status_screen(now, nullptr, {90});
  const auto first = screen.find("/arm (parameters)");
  ASSERT_NE(first, std::string::npos);
  EXPECT_EQ(screen.find("/arm", first + 1), std::string::npos) << screen;
}

TEST(StatusScreen, WhoDrives) {
  Json now = status(1, 0);
  const auto driven = [&](const char* direction, const char* wheel) {
    Json& link = now["links"][0];
    link["wheel"] = wheel;
    link["topics"][0]["wheel"] = wheel;
    link["topics"][0]["direction"] = direction;
    return status_screen(now, nullptr, {100, 0, true});
  };
  EXPECT_THAT(driven("export", "yours"), HasSubstr("\x1b[32myou drive the robot\x1b[0m\n"));
  EXPECT_THAT(driven("import", "yours"), HasSubstr("\x1b[32mdrives the robot\x1b[0m\n"));
  EXPECT_THAT(driven("import", "taken"), HasSubstr("\x1b[33manother operator drives\x1b[0m\n"));
  EXPECT_THAT(driven("export", "halted"), HasSubstr("\x1b[31mhalted: let go first\x1b[0m\n"));
  EXPECT_THAT(driven("export", "free"), HasSubstr("  nobody drives\n"));
  EXPECT_THAT(driven("export", "taken"), testing::ContainsRegex("/scan .*another operator drives"));
}

TEST(StatusScreen, ARelayThatIsConnectedIsNamed) {
  Json now = status(3, 40);
  now["relays"] = {{{"relay", "wss://r@relay"},
                    {"connected", true},
                    {"connected_since", "2026-01-31T09:00:00.000Z"}}};
  EXPECT_THAT(status_screen(now, nullptr, {0}),
              HasSubstr(", connected to the relay wss://r@relay for 3 h"));
  now["relays"][0]["connected"] = false;
  EXPECT_THAT(status_screen(now, nullptr, {0}),
              AllOf(Not(HasSubstr("connected to the relay")),
                    HasSubstr("no connection to the relay wss://r@relay")));
}

TEST(StatusScreen, FilesThatAreRefusedOrCannotBeWritten) {
  Json now = status(3, 40);
  now["refused_files"] = {{{"reason", "tokens.yaml:3: it"}}};
  now["status_file_problem"] = "cannot write it";
  EXPECT_THAT(status_screen(now, nullptr, {0}),
              AllOf(HasSubstr("a changed file is refused, what was read before stays in use: "
                              "tokens.yaml:3: it\n"),
                    HasSubstr("the status file cannot be written: cannot write it\n")));
}

TEST(StatusScreen, BothSidesInOneGraph) {
  Json now = status(1, 0);
  now["links"][0]["same_graph"] = true;
  now["links"][0]["two_of_a_kind"] = true;
  EXPECT_THAT(status_screen(now, nullptr, {100}),
              AllOf(HasSubstr("link 7: both sides are in one ROS graph"),
                    HasSubstr("link 7: by the key `robot` both sides are operators")));
}

TEST(StatusScreen, FindingsOfTheOtherEnd) {
  Json now = status(1, 0);
  now["links"][0]["peer_findings"] = {{{"id", "stamps_old"}, {"name", "/cmd_vel"}},
                                      {{"id", "path_full"}, {"name", ""}}};
  EXPECT_THAT(status_screen(now, nullptr, {100}),
              AllOf(HasSubstr("link 7: the other end reports /cmd_vel stamps old (ctl doctor)"),
                    HasSubstr("link 7: the other end reports path full (ctl doctor)")));
}

TEST(StatusScreen, WhyATopicIsNotForwarded) {
  Json now = status(1, 0);
  Json& topic = now["links"][0]["topics"][0];
  topic["state"] = "declined";
  topic["declined"] = "another type";
  EXPECT_THAT(status_screen(now, nullptr, {9}), HasSubstr("declined: another type"));
  topic.erase("declined");
  topic["state"] = "no_subscriber";
  EXPECT_THAT(status_screen(now, nullptr, {9}), HasSubstr("no subscriber"));
}

TEST(StatusScreen, ManyTopicsStayOneScreen) {
  Json now = status(1, 0);
  Json& topics = now["links"][0]["topics"];
  for (int i = 0; i < 300; ++i) topics.push_back(topics[0]);
  const std::string screen = status_screen(now, nullptr, {20});
  EXPECT_LT(std::count(screen.begin(), screen.end(), '\n'), 32);
  EXPECT_THAT(screen, AllOf(HasSubstr("... and 28"), HasSubstr("/dock (action)")));
}

// A terminal obeys control characters, and another program may answer at the address.
TEST(StatusScreen, WhatAPeerNamesIsText) {
  EXPECT_THAT(status_screen(status(1, 0, "/a\x1b[2J\n\xc2\x9b"), nullptr, {9}),
              AllOf(Not(HasSubstr("\x1b")), Not(HasSubstr("\xc2\x9b"))));
  for (const char* odd : {"[]", "{}", "7", R"({"links": 7})", R"({"links": [7, []]})",
                          R"({"time": 1, "links": [{"topics": {"a": {}}, "clock": 7}]})"})
    EXPECT_FALSE(status_screen(Json::parse(odd), Json::parse(odd), {9}).empty()) << odd;
}

}  // namespace
}  // namespace connect_bridge
