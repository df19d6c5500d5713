#include "relay/relay_status.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "core/base/json.hpp"

namespace connect_bridge {
namespace {

using testing::HasSubstr;

RelayStatus busy_relay() {
  RelayStatus status;
  status.version = "1.2";
  status.robots = {{"robot7", "203.0.113.5:4711", std::chrono::seconds(70), {2, 5, 1000, 2000}},
                   {"robot8", "", {}, {1, 1, 0, 0}}};
  status.robots[0].twin = true;
  status.all = {3, 9, 3000, 4000};
  status.refused[static_cast<std::size_t>(RelayRefusal::kNoSuchRobot)] = 4;
  return status;
}

TEST(RelayStatus, IsJsonInTheWordsOfAServersStatus) {
  const Json json = Json::parse(to_json(busy_relay(), false, true));
  EXPECT_EQ(json["role"], "relay");
  EXPECT_EQ(json["version"], "1.2");
  EXPECT_EQ(json["refused"]["no_such_robot"], 4);
  EXPECT_EQ(json["robots"][0]["open_seconds"], 70);
  EXPECT_EQ(json["robots"][0]["sent_bytes"], 1000);
  EXPECT_EQ(json["robots"][1]["open"], false);
  EXPECT_EQ(json["robots"][0]["token_in_use"], true);
  EXPECT_EQ(json["robots"][1]["token_in_use"], false);
  EXPECT_EQ(json["robots"][0]["peer"], "203.0.113.5:4711");
  EXPECT_EQ(json["all"]["pairs"], 3);
  EXPECT_FALSE(json.contains("certificate_valid_until"));
  RelayStatus ends = busy_relay();
  ends.certificate_valid_until = "2027-01-31T12:00:00Z";
  EXPECT_EQ(Json::parse(to_json(ends, false, true))["certificate_valid_until"],
            "2027-01-31T12:00:00Z");
  const Json public_one = Json::parse(to_json(busy_relay(), false, false));
  EXPECT_FALSE(public_one["robots"][0].contains("peer"));
  EXPECT_EQ(public_one["robots"][0]["open"], true);
}

TEST(RelayStatus, IsMetricsWithoutAddresses) {
  const std::string text = to_metrics(busy_relay(), true);
  for (const char* line : {"connect_bridge_sent_bytes_total 3000\n", "connect_bridge_robots 1\n",
                           "connect_bridge_connections_refused_total{reason=\"no_such_robot\"} 4\n",
                           "connect_bridge_robot_open{robot=\"robot8\"} 0\n",
                           "connect_bridge_robot_pairs{robot=\"robot7\"} 2\n"})
    EXPECT_THAT(text, HasSubstr(line));
  EXPECT_THAT(text, testing::Not(HasSubstr("203.0.113.5")));
  EXPECT_TRUE(text.ends_with("# EOF\n"));
}

TEST(RelayStatus, EveryRefusalHasANameOfItsOwn) {
  std::set<std::string_view> names;
  for (std::size_t i = 0; i < kRelayRefusals; ++i)
    names.insert(name_of(static_cast<RelayRefusal>(i)));
  EXPECT_EQ(names.size(), kRelayRefusals);
  EXPECT_FALSE(names.contains("unknown"));
}

}  // namespace
}  // namespace connect_bridge
