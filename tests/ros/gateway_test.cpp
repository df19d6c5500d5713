#include "ros/gateway.hpp"

#include <cstdlib>
#include <filesystem>
#include <set>
#include <sstream>

#include "core/graph/graph_view.hpp"
#include "ros/rcl/middleware.hpp"
#include "ros/ros_fixture.hpp"
#include "ros/types/type_supports.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge::ros {
namespace {

class GatewayTest : public RosTest {
 protected:
  void subscribe(TestSide& side, const std::string& name, std::uint32_t depth = 10) {
    side.gateway.apply(CreateSubscription{kSubscription, name, kString, "", qos_of_depth(depth)});
  }
  void mirror(TestSide& side, const std::string& name, const Qos& qos) {
    side.gateway.apply(CreateMirror{kMirror, name, kString, "", qos});
  }
};

TEST_F(GatewayTest, TakesWhatOthersPublish) {
  TestNode talker("talker");
  TestSide side("connect_server");
  RawPublisher publisher(talker, topic("chatter"));
  subscribe(side, topic("chatter"));
  ASSERT_TRUE(side.until([&] { return publisher.matched() == 1; }));
  const Bytes small = string_message("hello"), large = string_message(std::string(500000, 'x'));
  publisher.publish(small);
  publisher.publish(large);
  publisher.publish(small);
  for (const Bytes& expected : {small, large, small}) {
    const auto message = side.next<MessageTaken>();
    ASSERT_TRUE(message);
    EXPECT_EQ(kSubscription, message->subscription);
    EXPECT_EQ(publisher.gid(), message->origin);
    EXPECT_NE(0, message->stamp);
    EXPECT_TRUE(expected == bytes_of(message->payload));
  }
  EXPECT_EQ(3u, side.gateway.counters().taken);
}

// Other bridges are told of it: whatever the name of its node, it is no node's publisher.
TEST_F(GatewayTest, TellsTheIdOfEachMirror) {
  TestSide side("connect_server");
  mirror(side, topic("chatter"), qos_of_depth(1));
  const auto made = side.next<MirrorMade>();
  ASSERT_TRUE(made);
  EXPECT_EQ(kMirror, made->mirror);
  EXPECT_NE(Gid{}, made->gid);
}

// A process of Fast DDS has one type for a topic: what has ended must not be in the way.
TEST_F(GatewayTest, AnotherTypeTakesATopicAtOnce) {
  TestSide side("connect_server");
  subscribe(side, topic("chatter"));
  side.gateway.apply(DestroySubscription{kSubscription});
  side.gateway.apply(CreateSubscription{SubscriptionId{8}, topic("chatter"),
                                        "rcl_interfaces/msg/Log", "", qos_of_depth(1)});
  EXPECT_FALSE(side.next<SubscriptionFailed>(200ms));
  EXPECT_EQ(1u, side.gateway.counters().subscriptions);
}

// When a link is lost there can be thousands: others get their turns in between.
TEST_F(GatewayTest, ManyThatEndLeaveTheGraphAFewAtATime) {
  TestNode onlooker("onlooker");
  TestSide side("connect_client");
  constexpr std::uint32_t kMany = 400;
  const auto in_graph = [&] {
    std::size_t count = 0;
    EXPECT_EQ(RCL_RET_OK,
              rcl_count_publishers(onlooker->handle(), topic("chatter").c_str(), &count));
    return count;
  };
  for (std::uint32_t id = 1; id <= kMany; ++id)
    side.gateway.apply(CreateMirror{MirrorId{id}, topic("chatter"), kString, "", qos_of_depth(1)});
  ASSERT_TRUE(side.until([&] { return in_graph() == kMany; }));
  for (std::uint32_t id = 1; id <= kMany; ++id) side.gateway.apply(DestroyMirror{MirrorId{id}});
  EXPECT_EQ(0u, side.gateway.counters().mirrors);
  const auto ignore = [](Input&&) {};
  EXPECT_TRUE(side.gateway.drain(ignore)) << "all ended at one go";
  EXPECT_TRUE(side.until([&] { return in_graph() == 0; }));
}

TEST_F(GatewayTest, PublishesOnMirrors) {
  TestNode listener("listener");
  TestSide side("connect_client");
  RawSubscription subscription(listener, topic("chatter"));
  mirror(side, topic("chatter"), qos_of_depth(5));
  const auto seen = [](const TopicState& state) { return state.subscribers.size() == 1; };
  ASSERT_TRUE(side.topic_state(topic("chatter"), seen));
  const Bytes sent = string_message("hello");
  std::optional<Bytes> received;
  // The graph knows a subscription shortly before it is matched.
  ASSERT_TRUE(side.until([&] {
    side.gateway.apply(Publish{kMirror, Payload::copy_of(sent)});
    return (received = subscription.take()).has_value();
  }));
  EXPECT_EQ(sent, *received);
}

// A subscriber allocates memory for as many elements as a sequence claims to have.
TEST_F(GatewayTest, PublishesNothingThatIsNoMessageOfTheType) {
  TestNode listener("listener");
  TestSide side("connect_client");
  RawSubscription subscription(listener, topic("chatter"));
  mirror(side, topic("chatter"), qos_of_depth(5));
  const auto seen = [](const TopicState& state) { return state.subscribers.size() == 1; };
  ASSERT_TRUE(side.topic_state(topic("chatter"), seen));
  Bytes bad = string_message(std::string(2000, 'x'));
  bad[7] = 0xff;  // the length
  side.gateway.apply(Publish{kMirror, Payload::copy_of(bad)});
  const auto failed = side.next<PublishFailed>();
  ASSERT_TRUE(failed);
  EXPECT_EQ(1u, failed->count);
  const Bytes good = string_message(std::string(2000, 'x'));
  std::optional<Bytes> received;
  ASSERT_TRUE(side.until([&] {
    side.gateway.apply(Publish{kMirror, Payload::copy_of(good)});
    return (received = subscription.take()).has_value();
  }));
  EXPECT_EQ(good, *received);
}

TEST_F(GatewayTest, UnknownIdsAreIgnored) {
  TestSide side("connect_client");
  side.gateway.apply(DestroySubscription{kSubscription});
  side.gateway.apply(DestroyMirror{kMirror});
  side.gateway.apply(Publish{kMirror, Payload::adopt(string_message("nowhere"))});
  side.gateway.apply(DestroyServiceMirror{ServiceMirrorId{1}});
  side.gateway.apply(SendResponse{ServiceMirrorId{1}, RequestId{1}, {}});
  side.gateway.apply(DropRequest{ServiceMirrorId{1}, RequestId{1}});
  side.gateway.apply(DestroyServiceClient{ServiceClientId{1}});
  side.gateway.apply(SendRequest{ServiceClientId{1}, InvocationId{1}, {}});
  side.gateway.apply(DropInvocation{ServiceClientId{1}, InvocationId{1}});
  EXPECT_EQ(0u, side.gateway.counters().published);
}

TEST_F(GatewayTest, RefusesTypesThatAreNotInstalled) {
  GatewayOptions options;
  options.types_not_installed = false;
  TestSide side("connect_client", options);
  for (const char* type : {"no_such_package/msg/Thing", "std_msgs/msg/NoSuchMessage",
                           "../../evil/msg/String", "String", "std_msgs/msg/Str/ing", ""}) {
    side.gateway.apply(CreateMirror{kMirror, topic("chatter"), type, "", qos_of_depth(1)});
    const auto failed = side.next<MirrorFailed>();
    ASSERT_TRUE(failed) << type;
    EXPECT_EQ(kMirror, failed->id);
    EXPECT_EQ("type_unknown", failed->code);
    EXPECT_NE("", failed->reason);
  }
  side.gateway.apply(CreateSubscription{kSubscription, topic("chatter"), "nav_gadgets/msg/A", "",
                                        qos_of_depth(1)});
  const auto failed = side.next<SubscriptionFailed>();
  ASSERT_TRUE(failed);
  EXPECT_EQ("type_unknown", failed->code);
  EXPECT_NE(std::string::npos, failed->reason.find("ros-<distro>-nav-gadgets")) << failed->reason;
}

// A peer may ask for any package, and each search goes through the file system.
TEST(TypeSupports, AMissingPackageIsNotSearchedForAgainAtOnce) {
  namespace fs = std::filesystem;
  const std::string type = "made_up/msg/Thing";
  const std::string before = std::getenv("AMENT_PREFIX_PATH");
  const fs::path prefix = test::scratch_folder();
  ::setenv("AMENT_PREFIX_PATH", prefix.c_str(), 1);
  const auto reason = [&](TypeSupports& types) {
    const auto found = types.message(type, "");
    return std::get<Refusal>(found).reason;
  };
  TypeSupports types;
  EXPECT_NE(std::string::npos, reason(types).find("is not known here"));
  fs::create_directories(prefix / "share/ament_index/resource_index/packages/made_up");
  fs::create_directories(prefix / "lib");
  std::stringstream prefixes(before);
  for (std::string each; std::getline(prefixes, each, ':');) {
    const fs::path library = fs::path(each) / "lib/libstd_msgs__rosidl_typesupport_c.so";
    if (fs::exists(library))
      fs::copy_file(library, prefix / "lib/libmade_up__rosidl_typesupport_c.so",
                    fs::copy_options::skip_existing);
  }
  EXPECT_NE(std::string::npos, reason(types).find("is not known here"));
  TypeSupports others;
  EXPECT_NE(std::string::npos, reason(others).find("has no type"));
  ::setenv("AMENT_PREFIX_PATH", before.c_str(), 1);
}

TEST_F(GatewayTest, RefusesTypesWithAnotherHash) {
  TestNode talker("talker");
  TestSide side("connect_client");
  RawPublisher publisher(talker, topic("chatter"));
  const auto state = side.topic_state(topic("chatter"), [](const TopicState&) { return true; });
  ASSERT_TRUE(state);
  if (state->type_hash.empty()) GTEST_SKIP() << "this distribution has no type hashes";
  EXPECT_EQ(0u, state->type_hash.find("RIHS01_"));
  side.gateway.apply(
      CreateMirror{kMirror, topic("chatter"), kString, state->type_hash, qos_of_depth(1)});
  std::string other = state->type_hash;
  other.back() = other.back() == '0' ? '1' : '0';
  side.gateway.apply(
      CreateSubscription{kSubscription, topic("chatter"), kString, other, qos_of_depth(1)});
  const auto failed = side.next<SubscriptionFailed>();
  ASSERT_TRUE(failed);
  EXPECT_EQ("type_mismatch", failed->code);
  EXPECT_EQ(1u, side.gateway.counters().mirrors);
  EXPECT_EQ(0u, side.gateway.counters().subscriptions);
}

// A process of Fast DDS cannot have both types; with other middlewares it may.
TEST_F(GatewayTest, TellsBothTypesOfATopic) {
  TestNode other("counter");
  TestSide side("connect_client");
  RawPublisher publisher(other, topic("chatter"));
  mirror(side, topic("chatter"), qos_of_depth(1));
  ASSERT_TRUE(side.topic_state(topic("chatter"), [](const TopicState& state) {
    return node_of(state.publishers.at(0)) == "/counter";
  }));
  side.gateway.apply(CreateSubscription{kSubscription, topic("chatter"), "std_msgs/msg/Int32", "",
                                        qos_of_depth(1)});
  const auto failed = side.next<SubscriptionFailed>(1s);
  if (!failed) GTEST_SKIP() << "this middleware has both";
  EXPECT_EQ("type_mismatch", failed->code);
  for (const char* word : {"has the type std_msgs/msg/String (", "/counter", "/connect_client",
                           "cannot have the type std_msgs/msg/Int32"})
    EXPECT_NE(std::string::npos, failed->reason.find(word)) << failed->reason;
}

TEST_F(GatewayTest, RefusesNamesThatAreNone) {
  TestSide side("connect_client");
  side.gateway.apply(CreateMirror{kMirror, "/not a name", kString, "", qos_of_depth(1)});
  const auto failed = side.next<MirrorFailed>();
  ASSERT_TRUE(failed);
  EXPECT_EQ("failed", failed->code);
}

TEST_F(GatewayTest, LateSubscriptionsGetTransientLocalHistory) {
  TestNode talker("talker");
  TestSide side("connect_server");
  Qos qos = qos_of_depth(3);
  qos.durability = Durability::kTransientLocal;
  RawPublisher publisher(talker, topic("static"), qos);
  for (const char* text : {"a", "b", "c", "d"}) publisher.publish(string_message(text));
  side.gateway.apply(CreateSubscription{kSubscription, topic("static"), kString, "", qos});
  for (const char* text : {"b", "c", "d"}) {
    const auto message = side.next<MessageTaken>();
    ASSERT_TRUE(message);
    EXPECT_EQ(string_message(text), bytes_of(message->payload));
  }
}

TEST_F(GatewayTest, ReportsIncompatibleQos) {
  if (middleware().joins_any_qos) GTEST_SKIP() << "this middleware joins them";
  TestNode other("other");
  TestSide side("connect_server");
  Qos weak = qos_of_depth(5);
  weak.reliability = Reliability::kBestEffort;
  RawPublisher publisher(other, topic("a"), weak);
  subscribe(side, topic("a"));
  const auto report = side.next<QosIncompatible>();
  ASSERT_TRUE(report);
  EXPECT_EQ(topic("a"), report->topic);
  EXPECT_EQ("reliability", report->policy);
}

TEST_F(GatewayTest, TakesInTurnsAndBounded) {
  TestNode talker("talker");
  GatewayOptions options;
  options.steps_per_wake_max = 4;
  TestSide side("connect_server", options);
  const std::string names[] = {topic("a"), topic("b")};
  RawPublisher publishers[] = {RawPublisher(talker, names[0], qos_of_depth(100)),
                               RawPublisher(talker, names[1], qos_of_depth(100))};
  for (std::uint32_t i = 0; i < 2; ++i) {
    side.gateway.apply(
        CreateSubscription{SubscriptionId{i + 1}, names[i], kString, "", qos_of_depth(100)});
  }
  // Both ends know of each other when something has arrived.
  for (auto& publisher : publishers) {
    bool arrived = false;
    for (int i = 0; i < 200 && !arrived; ++i) {
      publisher.publish(string_message("are you there"));
      arrived = side.next<MessageTaken>(50ms).has_value();
    }
    ASSERT_TRUE(arrived);
  }
  side.drain_for(300ms);
  for (int i = 0; i < 20; ++i) publishers[0].publish(string_message("flood"));
  publishers[1].publish(string_message("command"));
  std::this_thread::sleep_for(200ms);
  std::vector<std::uint32_t> order;
  int drains = 0;
  bool more = true;
  while (more && drains < 50) {
    const std::size_t before = order.size();
    more = side.gateway.drain([&](Input&& input) {
      if (auto* taken = std::get_if<MessageTaken>(&input)) {
        order.push_back(taken->subscription.value);
      }
    });
    EXPECT_LE(order.size() - before, 4u);
    ++drains;
  }
  ASSERT_EQ(21u, order.size());
  EXPECT_GE(drains, 5);
  EXPECT_TRUE(order[0] == 2 || order[1] == 2) << "the command waits behind the flood";
}

// The sink destroys the entity that is being drained, and its slot goes to another one.
TEST_F(GatewayTest, TheSinkMayDestroyWhatIsDrained) {
  TestNode talker("talker");
  TestSide side("connect_server");
  RawPublisher publisher(talker, topic("chatter"), qos_of_depth(50));
  subscribe(side, topic("chatter"), 50);
  ASSERT_TRUE(side.until([&] { return publisher.matched() == 1; }));
  for (int i = 0; i < 10; ++i) publisher.publish(string_message("x"));
  int taken = 0;
  for (int i = 0; i < 1000 && taken == 0; ++i) {
    std::this_thread::sleep_for(10ms);
    side.gateway.drain([&](Input&& input) {
      if (!std::holds_alternative<MessageTaken>(input)) return;
      ++taken;
      side.gateway.apply(DestroySubscription{kSubscription});
      mirror(side, topic("other"), qos_of_depth(1));
    });
  }
  side.drain_for(100ms);
  EXPECT_EQ(1, taken);
}

TEST_F(GatewayTest, ManyCyclesWhileCallbacksFire) {
  if (may_block_when_destroying()) GTEST_SKIP() << "ros2/rmw_zenoh#993";
  TestNode talker("talker");
  TestSide side("connect_server");
  RawPublisher publisher(talker, topic("chatter"), qos_of_depth(10));
  std::atomic<bool> stop{false};
  std::thread flood([&] {
    while (!stop) publisher.publish(string_message("x"));
  });
  std::uint64_t taken = 0;
  const int cycles = 1000;
  for (std::uint32_t i = 1; i <= cycles; ++i) {
    const SubscriptionId id{i};
    side.gateway.apply(CreateSubscription{id, topic("chatter"), kString, "", qos_of_depth(10)});
    side.gateway.apply(CreateMirror{MirrorId{i}, topic("chatter"), kString, "", qos_of_depth(10)});
    const auto count = [&](Input&& input) { taken += std::holds_alternative<MessageTaken>(input); };
    // Sometimes the publisher finds the subscription in time.
    for (int n = 0; i % 20 == 0 && n < 20; ++n) {
      side.alarm.wait(std::chrono::steady_clock::now() + 5ms);
      side.gateway.drain(count);
    }
    side.gateway.apply(DestroyMirror{MirrorId{i}});
    side.gateway.apply(DestroySubscription{id});
    side.gateway.drain(
        [&](Input&& input) { EXPECT_FALSE(std::holds_alternative<MessageTaken>(input)); });
  }
  stop = true;
  flood.join();
  EXPECT_GT(taken, 0u);
  EXPECT_EQ(0u, side.gateway.counters().subscriptions);
  EXPECT_EQ(0u, side.gateway.counters().mirrors);
}

TEST_F(GatewayTest, StopsInTimeAndLeavesNoThread) {
  {
    TestSide first("connect_first");  // the middleware keeps threads of its own from here on
    subscribe(first, topic("warm"));
  }
  const std::size_t before = threads();
  std::chrono::steady_clock::time_point begin;
  {
    TestNode talker("talker");
    RawPublisher publisher(talker, topic("chatter"));
    TestSide side("connect_server");
    subscribe(side, topic("chatter"));
    mirror(side, topic("other"), qos_of_depth(1));
    ASSERT_TRUE(side.until([&] { return publisher.matched() == 1; }));
    publisher.publish(string_message("not taken"));
    begin = std::chrono::steady_clock::now();
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 1s);
  // The kernel lists a thread for a moment after it was joined.
  const auto end = std::chrono::steady_clock::now() + 2s;
  while (threads() > before && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(1ms);
  }
  EXPECT_GE(before, threads());
}

}  // namespace
}  // namespace connect_bridge::ros
