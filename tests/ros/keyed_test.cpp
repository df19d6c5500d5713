// Types with keys.
#include <rmw/rmw.h>
#include <rosidl_typesupport_introspection_c/message_introspection.h>

#include <set>
#include <string_view>

#include "ros/gateway.hpp"
#include "ros/ros_fixture.hpp"
#include "ros/service_fixture.hpp"
#include "ros/types/cdr_check.hpp"

namespace connect_bridge::ros {
namespace {

using KeyedTest = RosTest;

template <class Members>
constexpr bool tells_keys(const Members&) {
  return requires(Members members) {
    members.has_any_key_member_;
  };
}

// rmw_cyclonedds_cpp 4.0.3 and rmw_zenoh_cpp 0.6.7 know no keys.
bool knows_keys() {
  const std::string_view rmw = rmw_get_implementation_identifier();
  return rmw != "rmw_cyclonedds_cpp" && rmw != "rmw_zenoh_cpp";
}

// A late subscriber gets the last sample of each sensor, not of all together.
TEST_F(KeyedTest, SamplesOfEachKeyAreKeptApart) {
  if (!tells_keys(rosidl_typesupport_introspection_c__MessageMembers{}))
    GTEST_SKIP() << "before Kilted a type's keys are not told";
  const std::string type = std::string{kTestPackage} + "/msg/Keyed";
  TestSide side("connect_client");
  Qos qos = qos_of_depth(1);
  qos.durability = Durability::kTransientLocal;
  side.gateway.apply(CreateMirror{kMirror, topic("sensors"), type, "", qos});
  for (std::uint32_t sensor : {1, 2, 3, 2})
    side.gateway.apply(
        Publish{kMirror, Payload::adopt(Cdr{}.u32(sensor).u32(0).u64(sensor).bytes())});
  Bytes large = Cdr{}.u32(4).u32(0).u64(4).bytes();
  large.resize(2 << 20);  // what is behind the last field is nobody's
  side.gateway.apply(Publish{kMirror, Payload::adopt(std::move(large))});
  side.gateway.apply(Publish{kMirror, Payload::adopt(Cdr{}.u32(1).bytes())});
  const auto failed = side.next<PublishFailed>();
  ASSERT_TRUE(failed);
  EXPECT_EQ(1u, failed->count);
  TestNode listener("listener");
  qos.depth = 10;
  RawSubscription subscription(listener, topic("sensors"), qos, type);
  std::multiset<std::uint8_t> expected{4}, sensors;
  if (knows_keys()) expected = {1, 2, 3, 4};
  side.until([&] {
    while (const auto taken = subscription.take()) sensors.insert(taken->at(kCdrHeaderSize));
    return sensors.size() >= expected.size();
  });
  EXPECT_EQ(expected, sensors);
}

}  // namespace
}  // namespace connect_bridge::ros
