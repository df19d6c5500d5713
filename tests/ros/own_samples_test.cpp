// What this process publishes on a topic that it also subscribes to.
#include "ros/ros_fixture.hpp"

namespace connect_bridge::ros {
namespace {

class OwnSamplesTest : public RosTest {
 protected:
  static void open(TestSide& side) {
    const std::string name = topic("chatter");
    side.gateway.apply(CreateMirror{kMirror, name, kString, "", qos_of_depth(10)});
    side.gateway.apply(CreateSubscription{kSubscription, name, kString, "", qos_of_depth(10)});
  }
};

TEST_F(OwnSamplesTest, IgnoresItsOwnMirrors) {
  TestNode talker("talker");
  TestSide side("connect_server");
  open(side);
  RawPublisher publisher(talker, topic("chatter"));
  ASSERT_TRUE(side.until([&] { return publisher.matched() == 1; }));
  side.gateway.apply(Publish{kMirror, Payload::adopt(string_message("own"))});
  side.gateway.apply(DestroyMirror{kMirror});
  publisher.publish(string_message("other"));
  const auto message = side.next<MessageTaken>();
  ASSERT_TRUE(message);
  EXPECT_EQ(string_message("other"), bytes_of(message->payload));
  side.drain_for(100ms);
  EXPECT_FALSE(side.next<MessageTaken>(0ms));
}

// A topic that crosses both ways: our samples and those of others wait in one queue.
TEST_F(OwnSamplesTest, LosesNothingBehindItsOwnSamples) {
  TestNode talker("talker");
  TestSide side("connect_server");
  open(side);
  RawPublisher publisher(talker, topic("chatter"));
  ASSERT_TRUE(side.until([&] {
    publisher.publish(string_message("first"));
    return side.next<MessageTaken>(50ms).has_value();
  }));
  side.drain_for(100ms);
  side.inputs.clear();
  for (int i = 0; i < 20; ++i) {
    const Bytes other = string_message("other " + std::to_string(i));
    side.gateway.apply(Publish{kMirror, Payload::adopt(string_message("own"))});
    publisher.publish(other);
    const auto message = side.next<MessageTaken>();
    ASSERT_TRUE(message) << i;
    EXPECT_EQ(other, bytes_of(message->payload));
  }
}

}  // namespace
}  // namespace connect_bridge::ros
