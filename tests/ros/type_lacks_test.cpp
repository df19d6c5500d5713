// What a gateway says of topics and services whose types cannot be taken.
#include "ros/gateway.hpp"
#include "ros/rcl/middleware.hpp"
#include "ros/ros_fixture.hpp"
#include "ros/service_fixture.hpp"
#include "ros/types/type_supports.hpp"

namespace connect_bridge::ros {
namespace {

constexpr char kUnknown[] = "made_up_lacking/msg/Thing";
constexpr char kUnknownService[] = "made_up_lacking/srv/Do";
const std::string kMadeUpHash = "RIHS01_" + std::string(64, 'a');

class TypeLacksTest : public RosTest {
 protected:
  // Somebody has both, and a topic and a service of installed types.
  void make_all() {
    owner_.gateway.apply(
        CreateMirror{kMirror, topic("things"), kUnknown, kMadeUpHash, qos_of_depth(1)});
    owner_.gateway.apply(CreateServiceMirror{{1}, topic("do"), kUnknownService, kMadeUpHash});
  }
  static std::optional<ServiceState> service_of(const TestSide& side, const std::string& name) {
    for (const ServiceState& service : side.graph.services)
      if (service.name == name) return service;
    return std::nullopt;
  }

  TestSide owner_{"owner"};
};

TEST_F(TypeLacksTest, WithoutTypesThatAreNotInstalled) {
  if (!middleware().takes_bare_services) GTEST_SKIP() << "nothing can have such a service here";
  GatewayOptions options;
  options.types_not_installed = false;
  TestSide side("connect_server", options);
  make_all();
  TestNode talker("talker");
  RawPublisher known(talker, topic("chatter"));
  RawServer server(talker, topic("set"));
  const auto any = [](const TopicState&) { return true; };
  const auto things = side.topic_state(topic("things"), any);
  const auto chatter = side.topic_state(topic("chatter"), any);
  ASSERT_TRUE(things && chatter);
  ASSERT_TRUE(things->lack);
  EXPECT_EQ("type_unknown", things->lack->code);
  EXPECT_NE(std::string::npos, things->lack->reason.find("install the package made_up_lacking"));
  EXPECT_FALSE(chatter->lack);
  ASSERT_TRUE(
      side.until([&] { return service_of(side, topic("do")) && service_of(side, topic("set")); }));
  ASSERT_TRUE(service_of(side, topic("do"))->lack);
  EXPECT_EQ("type_unknown", service_of(side, topic("do"))->lack->code);
  EXPECT_FALSE(service_of(side, topic("set"))->lack);
}

TEST_F(TypeLacksTest, WhatIsMadeAtRunTimeIsNotLacking) {
  if (!middleware().takes_bare_services) GTEST_SKIP() << "nothing can have such a service here";
  TestSide side("connect_server");
  make_all();
  const auto any = [](const TopicState&) { return true; };
  const auto things = side.topic_state(topic("things"), any);
  ASSERT_TRUE(things);
  EXPECT_FALSE(things->lack);
  ASSERT_TRUE(side.until([&] { return service_of(side, topic("do")).has_value(); }));
  // The graph tells no hash of a service.
  EXPECT_EQ(middleware().joins_by_hash, service_of(side, topic("do"))->lack.has_value());
}

// The same answer as to one who tries.
TEST(TypeSupports, TellWhatTheyLackBeforeItIsTried) {
  for (const bool not_installed_too : {false, true}) {
    TypeSupports types(not_installed_too);
    for (const std::string& hash : {std::string{}, kMadeUpHash}) {
      for (const char* type : {kString, kUnknown, "std_msgs/msg/NoSuchType", "no name",
                               "made_up_lacking/action/Fly_FeedbackMessage"}) {
        const bool installed = std::string(type) == kString;
        const bool taken =
            std::holds_alternative<MessageType>(types.message(type, installed ? "" : hash));
        EXPECT_EQ(taken, !types.lack_of(type, hash, false)) << type << " " << hash;
      }
      for (const char* type : {kSetBool, kUnknownService, "std_srvs/srv/NoSuchType", "no name"}) {
        const bool installed = std::string(type) == kSetBool;
        const bool taken = std::holds_alternative<std::shared_ptr<ServiceType>>(
            types.service(type, installed ? "" : hash));
        EXPECT_EQ(taken, !types.lack_of(type, hash, true)) << type << " " << hash;
      }
    }
  }
}

}  // namespace
}  // namespace connect_bridge::ros
