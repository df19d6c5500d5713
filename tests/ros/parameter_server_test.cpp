#include "ros/services/parameter_server.hpp"

#include <algorithm>
#include <cstdio>
#include <thread>

#include "ros/rcl/distro.hpp"
#include "ros/ros_fixture.hpp"
#include "unit/source_text.hpp"

namespace connect_bridge::ros {
namespace {

ParameterDescriptor entry(const std::string& name, ParameterValue value) {
  ParameterDescriptor made;
  made.name = name;
  made.type = type_of(value);
  made.value = std::move(value);
  made.description = "What " + name + " does";
  return made;
}

std::vector<ParameterDescriptor> entries() {
  std::vector<ParameterDescriptor> list{entry("listen.port", std::int64_t{9090}),
                                        entry("listen.address", std::string{"0.0.0.0"}),
                                        entry("rules", std::vector<std::string>{"a", "b"}),
                                        entry("rate", 1.5), entry("verbose", false)};
  list[0].read_only = true;
  list[0].constraints = "not below 1024 without rights";
  list[0].range = NumberRange{1, 65535};
  list[3].range = NumberRange{0, 100};
  return list;
}

std::optional<ParameterDescriptor> describe_rule(const std::string& name) {
  if (!name.starts_with("rule.")) return std::nullopt;
  return entry(name, std::vector<std::string>{});
}

// A parameter server with a loop that runs until a program has ended.
class RunningServer {
 public:
  explicit RunningServer(Node& node)
      : server(node,
               {[this] { return now; },
                [this](const std::vector<Parameter>& wanted) { return set(wanted); }, describe_rule,
                [this](bool on) { sim_time = on; }, [this] { alarm.wake(); }}) {}

  SetResult set(const std::vector<Parameter>& wanted) {
    for (const Parameter& parameter : wanted) {
      if (parameter.value == ParameterValue{13.0}) return {false, "13 brings bad luck"};
    }
    for (const Parameter& parameter : wanted) {
      const auto is_it = [&](const auto& known) { return known.name == parameter.name; };
      const auto at = std::find_if(now.begin(), now.end(), is_it);
      if (!parameter.value) {
        now.erase(at);
      } else if (at != now.end()) {
        at->value = parameter.value;
      } else {
        now.push_back(entry(parameter.name, *parameter.value));
      }
    }
    return {};
  }

  std::string run(const std::string& command) {
    std::string output;
    std::atomic<bool> ended{false};
    std::thread program([&] {
      FILE* pipe = popen(command.c_str(), "r");
      char buffer[4096];
      while (pipe && std::fgets(buffer, sizeof buffer, pipe)) output += buffer;
      if (pipe) pclose(pipe);
      ended = true;
      alarm.wake();
    });
    while (!ended) {
      alarm.wait(std::chrono::steady_clock::now() + 20ms);
      while (server.drain()) {
      }
    }
    program.join();
    return output;
  }

  Alarm alarm;
  bool sim_time = false;
  std::vector<ParameterDescriptor> now = entries();
  ParameterServer server;
};

std::string usual_client() {
  return "python3 -B '" + test::source_path("tests/ros/parameter_client.py") +
         "' /connect_server 2>&1";
}

using ParameterServerTest = RosTest;

TEST_F(ParameterServerTest, WorksWithTheUsualClient) {
  if (!CONNECT_TYPE_HASHES) GTEST_SKIP() << "rclpy has no client of parameters before Iron";
  TestNode node("connect_server");
  RunningServer server(*node);
  const std::string report = server.run(usual_client());
  const auto expect = [&](const std::string& part) {
    EXPECT_NE(std::string::npos, report.find(part)) << part << "\nis missing in\n" << report;
  };
  expect(
      R"("names": ["listen.address", "listen.port", "rate", "rules", "use_sim_time", "verbose"])");
  expect(R"("listen": ["listen.address", "listen.port"], "prefixes": ["listen"])");
  expect(R"("values": [9090, ["a", "b"], 1.5, false, null], "types": [2, 9, 3, 1, 0])");
  expect(R"("port": ["listen.port", 2, "What listen.port does", true, )"
         R"("not below 1024 without rights", 1, 65535])");
  expect(
      R"("set": [[true, ""], [false, "Wrong parameter type, parameter {rate} is of type )"
      R"({double}, setting it to {string} is not allowed."], [false, "parameter 'rate' must be)");
  expect(R"([false, "parameter 'listen.port' cannot be set because it is read-only"])");
  expect(R"([false, "parameter 'no_such' cannot be set because it was not declared"])");
  expect(R"([false, "13 brings bad luck"]], "added": [[true, ""]])");
  expect(R"("atomically": [false, "Wrong parameter type)");
  expect(R"("after": [7.0, false, ["/x"]])");
  expect(R"("deleted": [[true, ""], [false, "parameter 'rate' cannot be removed"]])");
  expect(R"("sim": [[true, ""]])");
  EXPECT_TRUE(server.sim_time);
}

TEST_F(ParameterServerTest, TellsParameterEvents) {
  if (!CONNECT_TYPE_HASHES) GTEST_SKIP() << "rclpy has no client of parameters before Iron";
  TestNode node("connect_server");
  TestNode listener("listener");
  RunningServer server(*node);
  RawSubscription events(listener, "/parameter_events", qos_of_depth(1000),
                         "rcl_interfaces/msg/ParameterEvent");
  server.run(usual_client());
  std::string text;
  const auto has = [&](const char* word) { return text.find(word) != std::string::npos; };
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (!has("use_sim_time") && std::chrono::steady_clock::now() < end) {  // it is the last one
    while (const auto event = events.take()) text.append(event->begin(), event->end());
    std::this_thread::sleep_for(10ms);
  }
  EXPECT_TRUE(has("use_sim_time"));
  EXPECT_TRUE(has("/connect_server"));
  EXPECT_TRUE(has("rule.a.deny"));
  EXPECT_EQ(std::string::npos, text.find("no_such"));
}

TEST_F(ParameterServerTest, ChangesAllOrNone) {
  TestNode node("connect_server");
  RunningServer server(*node);
  EXPECT_FALSE(server.server.set({{"verbose", true}, {"listen.port", std::int64_t{1}}}).successful);
  EXPECT_EQ(ParameterValue{false}, *server.now.back().value);
  EXPECT_TRUE(server.server.set({{"verbose", true}}).successful);
  EXPECT_EQ(ParameterValue{true}, *server.now.back().value);
}

TEST(ParameterTest, ChecksValues) {
  ParameterDescriptor ranged = entry("n", std::int64_t{4});
  ranged.range = NumberRange{2, 11};
  for (const auto& [value, good] :
       {std::pair<std::int64_t, bool>{2, true}, {5, true}, {11, true}, {1, false}, {12, false}}) {
    ParameterValue wanted = value;
    EXPECT_EQ(good, check_value(ranged, wanted).successful) << value;
  }
  ParameterDescriptor list = entry("l", std::vector<std::string>{"a"});
  ParameterValue nothing = std::vector<std::int64_t>{};
  EXPECT_TRUE(check_value(list, nothing).successful);
  EXPECT_EQ(ParameterValue{std::vector<std::string>{}}, nothing);
  ParameterValue nan = std::numeric_limits<double>::quiet_NaN();
  ParameterDescriptor number = entry("d", 1.0);
  number.range = NumberRange{0, 1};
  EXPECT_FALSE(check_value(number, nan).successful);
}

TEST(ParameterTest, ListsAsRclcppDoes) {
  EXPECT_TRUE(is_listed("a.b.c", {}, 0));
  EXPECT_TRUE(is_listed("a", {}, 1));
  EXPECT_FALSE(is_listed("a.b", {}, 1));
  EXPECT_TRUE(is_listed("a.b", {"a"}, 1));
  EXPECT_FALSE(is_listed("a.b.c", {"a"}, 1));
  EXPECT_TRUE(is_listed("a.b.c", {"a"}, 0));
  EXPECT_TRUE(is_listed("a.b", {"a.b"}, 1));
  EXPECT_FALSE(is_listed("ab.c", {"a"}, 0));
}

TEST(ParameterTest, NodeNamesOfFilesMatch) {
  EXPECT_TRUE(node_name_matches("/**", "/a/b"));
  EXPECT_TRUE(node_name_matches("/*", "/a"));
  EXPECT_FALSE(node_name_matches("/*", "/a/b"));
  EXPECT_TRUE(node_name_matches("a", "/a"));
  EXPECT_TRUE(node_name_matches("/**/b", "/b"));
  EXPECT_TRUE(node_name_matches("/**/b", "/x/y/b"));
  EXPECT_TRUE(node_name_matches("/*/b", "/x/b"));
  EXPECT_FALSE(node_name_matches("/a", "/ab"));
  EXPECT_FALSE(node_name_matches("/a/b", "/a"));
}

}  // namespace
}  // namespace connect_bridge::ros
