// Messages that are larger than messages may be.
#include "core/graph/claim_message.hpp"
#include "core/graph/graph_view.hpp"
#include "ros/gateway.hpp"
#include "ros/ros_fixture.hpp"

namespace connect_bridge::ros {
namespace {

using MessageSizeTest = RosTest;

TEST_F(MessageSizeTest, DropsWhatIsTooLarge) {
  TestNode talker("talker");
  GatewayOptions options;
  options.message_bytes_max = 100;
  TestSide side("connect_server", options);
  RawPublisher publisher(talker, topic("chatter"));
  side.gateway.apply(
      CreateSubscription{kSubscription, topic("chatter"), kString, "", qos_of_depth(10)});
  ASSERT_TRUE(side.until([&] { return publisher.matched() == 1; }));
  publisher.publish(string_message(std::string(200, 'x')));
  publisher.publish(string_message("small"));
  const auto lost = side.next<MessagesLost>();
  ASSERT_TRUE(lost);
  EXPECT_EQ(kSubscription, lost->subscription);
  EXPECT_EQ(1u, lost->count);
  EXPECT_TRUE(lost->too_large);
  const auto message = side.next<MessageTaken>();
  ASSERT_TRUE(message);
  EXPECT_EQ(string_message("small"), bytes_of(message->payload));
}

// However small messages must be: bridges that do not hear each other's claims feed the same.
TEST_F(MessageSizeTest, TakesAClaimOfAnySize) {
  TestNode bridge("bridge");
  GatewayOptions options;
  options.message_bytes_max = 100;
  TestSide side("connect_server", options);
  RawPublisher publisher(bridge, kClaimsTopic, qos_of_depth(1), kClaimsType);
  side.gateway.apply(
      CreateSubscription{kSubscription, kClaimsTopic, kClaimsType, "", qos_of_depth(1)});
  ASSERT_TRUE(side.until([&] { return publisher.matched() == 1; }));
  Claim claim;
  claim.origins.resize(100);
  const Bytes large = bytes_of(serialize(claim, 0));
  publisher.publish(large);
  const auto message = side.next<MessageTaken>();
  ASSERT_TRUE(message);
  EXPECT_EQ(large, bytes_of(message->payload));
}

}  // namespace
}  // namespace connect_bridge::ros
