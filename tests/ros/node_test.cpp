#include "ros/node/node.hpp"

#include <fstream>

#include "ros/ros_fixture.hpp"
#include "ros/topics/time_source.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge::ros {
namespace {

using NodeTest = RosTest;

TEST_F(NodeTest, ReadsArguments) {
  const std::string file = test::scratch_folder() + "parameters.yaml";
  std::ofstream(file) << R"(
/**:
  ros__parameters: {shared: 1, listen: {port: 1}}
/robot/bridge:
  ros__parameters:
    listen: {address: "::", port: 9091}
    rules: [a, b]
    ratios: [0.5, 1.0]
    numbers: [1, 2]
    flags: [true, false]
    max_age: 0.25
other_node:
  ros__parameters: {rules: [x]}
)";
  TestNode node("connect_server",
                {"--pair", "--ros-args", "-r", "__node:=bridge", "-r", "__ns:=/robot",
                 "--params-file", file, "-p", "on:=true", "--", "wss://robot"});
  EXPECT_EQ("bridge", node->facts().name);
  EXPECT_EQ("/robot", node->facts().name_space);
  EXPECT_EQ("/robot/bridge", node->facts().full_name);
  EXPECT_EQ((std::vector<std::string>{"--pair", "wss://robot"}), node->facts().arguments);
  const ParameterMap expected{{"shared", std::int64_t{1}},
                              {"listen.address", std::string{"::"}},
                              {"listen.port", std::int64_t{9091}},
                              {"rules", std::vector<std::string>{"a", "b"}},
                              {"ratios", std::vector<double>{0.5, 1.0}},
                              {"numbers", std::vector<std::int64_t>{1, 2}},
                              {"flags", std::vector<bool>{true, false}},
                              {"max_age", 0.25},
                              {"on", true}};
  EXPECT_EQ(expected, node->facts().parameter_overrides);
}

TEST_F(NodeTest, RefusesWrongArguments) {
  EXPECT_THROW(TestNode("n", {"--ros-args", "--no-such-thing"}), RosError);
  EXPECT_THROW(TestNode("n", {"--ros-args", "--params-file", "/no/such/file"}), RosError);
  EXPECT_THROW(TestNode("not a name"), RosError);
  // It did not stay half open.
  TestNode node("connect_server");
  EXPECT_EQ("/connect_server", node->facts().full_name);
}

TEST_F(NodeTest, LogsToRosout) {
  TestNode node("connect_server", {"--ros-args", "--log-level", "connect_server:=warn"});
  TestSide side("connect_client");
  side.gateway.apply(CreateSubscription{SubscriptionId{1}, "/rosout", "rcl_interfaces/msg/Log", "",
                                        qos_of_depth(100)});
  std::string seen;
  ASSERT_TRUE(side.until([&] {
    node->log(LogLevel::kInfo, "not enabled");
    node->log(LogLevel::kWarn, "link lost");
    while (const auto message = side.next<MessageTaken>(0ms)) {
      seen.append(message->payload.view().begin(), message->payload.view().end());
    }
    return seen.find("link lost") != std::string::npos;
  }));
  EXPECT_NE(std::string::npos, seen.find("connect_server"));
  EXPECT_EQ(std::string::npos, seen.find("not enabled"));
}

Bytes clock_message(std::int32_t seconds, std::uint32_t nanoseconds) {
  Bytes bytes{0, 1, 0, 0};
  for (const std::uint32_t word : {static_cast<std::uint32_t>(seconds), nanoseconds}) {
    for (int shift = 0; shift < 32; shift += 8) {
      bytes.push_back(static_cast<std::uint8_t>(word >> shift));
    }
  }
  return bytes;
}

TEST_F(NodeTest, FollowsSimTime) {
  TestNode simulator("simulator");
  TestSide side("connect_server");
  const Stamp year_2020 = 1577836800LL * 1000000000;
  EXPECT_GT(side.node->ros_now(), year_2020);
  RawPublisher clock(simulator, "/clock", qos_of_depth(1), "rosgraph_msgs/msg/Clock");
  side.gateway.set_use_sim_time(true);
  EXPECT_LT(side.node->ros_now(), year_2020);
  EXPECT_TRUE(side.until([&] {
    clock.publish(clock_message(12, 345));
    return side.node->ros_now() == 12000000345;
  }));
  side.gateway.set_use_sim_time(false);
  EXPECT_GT(side.node->ros_now(), year_2020);
}

TEST(ClockTest, IsParsedInBothByteOrders) {
  EXPECT_EQ(Stamp{5000000007}, parse_clock(clock_message(5, 7)));
  EXPECT_EQ(Stamp{5000000007}, parse_clock(Bytes{0, 0, 0, 0, 0, 0, 0, 5, 0, 0, 0, 7}));
  EXPECT_FALSE(parse_clock(Bytes{0, 1, 0, 0, 1}));
}

}  // namespace
}  // namespace connect_bridge::ros
