#include "ops/status/status_screen.hpp"

#include <gmock/gmock.h>

#include <algorithm>

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
                {"origins", 1},
                {"messages", messages},
                {"bytes", messages * 1000},
                {"queued", 2},
                {"latency_ms", 12.4},
                {"dropped", {{"rate", 3}}}};
  Json goals = {{"service", "/dock/_action/get_result"},
                {"direction", "import"},
                {"attached", true},
                {"pending", 1},
                {"calls", 4},
                {"answered", 3},
                {"lost", 1}};
  Json link = {{"link", 7},         {"node", "/robot"},    {"identity", "anna"},
               {"open", true},      {"open_seconds", 130}, {"clock", {{"round_trip_ms", 2.5}}},
               {"topics", {topic}}, {"services", {goals}}};
  return {{"time", "2026-01-31T12:00:0" + std::to_string(second) + ".500Z"},
          {"node", "/connect_client"},
          {"role", "client"},
          {"links", {link}}};
}

TEST(StatusScreen, RatesAndStates) {
  const std::string screen = status_screen(status(3, 40), status(1, 20), 100);
  EXPECT_THAT(screen, AllOf(HasSubstr("/connect_client (client)  1 link is open\n"),
                            HasSubstr("link 7  anna /robot"), HasSubstr("open for 2 min"),
                            HasSubstr("round trip 2.5 ms"), HasSubstr("/dock (goals)")));
  EXPECT_THAT(screen,
              testing::ContainsRegex("/scan  export +7 +10 +10 kB +12 ms +2 +rate 3 +flows\n"));
  EXPECT_THAT(screen, testing::ContainsRegex("import +7 +1 +4 +3 +lost 1 +can be called\n"));
  EXPECT_THAT(status_screen(status(3, 40), nullptr, 100), Not(HasSubstr("10 kB")));
}

TEST(StatusScreen, WhatIsMissingAndWhy) {
  Json now = status(1, 0);
  EXPECT_THAT(status_screen(now, nullptr, 9), Not(HasSubstr("DOES NOT CROSS")));
  now["links"][0]["missing"] = Json::parse(R"([{"kind": "topic", "name": "/cmd_vel",
    "direction": "export", "reason": "not_taken", "text": "the peer takes it only as a Twist"}])");
  EXPECT_THAT(
      status_screen(now, nullptr, 9),
      testing::ContainsRegex("/cmd_vel +topic +export +7 +the peer takes it only as a Twist\n"));
}

TEST(StatusScreen, WhyATopicDoesNotCross) {
  Json now = status(1, 0);
  Json& topic = now["links"][0]["topics"][0];
  topic["declined"] = "another type";
  EXPECT_THAT(status_screen(now, nullptr, 9), HasSubstr("does not cross: another type"));
  topic.erase("declined");
  topic["demanded"] = false;
  EXPECT_THAT(status_screen(now, nullptr, 9), HasSubstr("nobody listens there"));
}

TEST(StatusScreen, ManyTopicsStayOneScreen) {
  Json now = status(1, 0);
  Json& topics = now["links"][0]["topics"];
  for (int i = 0; i < 300; ++i) topics.push_back(topics[0]);
  const std::string screen = status_screen(now, nullptr, 20);
  EXPECT_LT(std::count(screen.begin(), screen.end(), '\n'), 32);
  EXPECT_THAT(screen, AllOf(HasSubstr("... and 28"), HasSubstr("/dock (goals)")));
}

// A terminal obeys control characters, and another program may answer at the address.
TEST(StatusScreen, WhatAPeerNamesIsText) {
  EXPECT_THAT(status_screen(status(1, 0, "/a\x1b[2J\n\xc2\x9b"), nullptr, 9),
              AllOf(Not(HasSubstr("\x1b")), Not(HasSubstr("\xc2\x9b"))));
  for (const char* odd : {"[]", "{}", "7", R"({"links": 7})", R"({"links": [7, []]})",
                          R"({"time": 1, "links": [{"topics": {"a": {}}, "clock": 7}]})"})
    EXPECT_FALSE(status_screen(Json::parse(odd), Json::parse(odd), 9).empty()) << odd;
}

}  // namespace
}  // namespace connect_bridge
