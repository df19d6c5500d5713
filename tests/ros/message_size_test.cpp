// Large messages, and those that are larger than messages may be.
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

// Large ones are checked beside the loop, and overtake nothing.
TEST_F(MessageSizeTest, LargeOnesKeepTheirOrder) {
  TestNode listener("listener");
  TestSide side("connect_server");
  RawSubscription subscription(listener, topic("chatter"));
  side.gateway.apply(CreateMirror{kMirror, topic("chatter"), kString, "", qos_of_depth(10)});
  const auto publish = [&](Bytes bytes) {
    side.gateway.apply(Publish{kMirror, Payload::adopt(std::move(bytes))});
  };
  ASSERT_TRUE(side.until([&] {
    publish(string_message("are you there"));
    side.drain_for(20ms);
    return subscription.take().has_value();
  }));
  side.drain_for(200ms);
  while (subscription.take()) {
  }
  const Bytes large = string_message(std::string(2 << 20, 'x'));
  Bytes no_string = large;
  no_string[7] = 0xff;  // longer than there are bytes
  publish(large);
  publish(string_message("first"));
  publish(no_string);
  publish(large);
  publish(string_message("second"));
  std::vector<std::size_t> sizes;
  side.until([&] {
    while (const auto taken = subscription.take()) sizes.push_back(taken->size());
    return sizes.size() == 4;
  });
  const std::size_t first = string_message("first").size();
  const std::size_t second = string_message("second").size();
  EXPECT_EQ((std::vector<std::size_t>{large.size(), first, large.size(), second}), sizes);
  const auto failed = side.next<PublishFailed>();
  ASSERT_TRUE(failed);
  EXPECT_EQ(1u, failed->count);
}

// One that has ended takes what is checked with it.
TEST_F(MessageSizeTest, AMirrorMayEndWhileALargeOneIsChecked) {
  TestSide side("connect_server");
  side.gateway.apply(CreateMirror{kMirror, topic("chatter"), kString, "", qos_of_depth(10)});
  const Payload large = Payload::adopt(string_message(std::string(8 << 20, 'x')));
  for (int n = 0; n < 5; ++n) side.gateway.apply(Publish{kMirror, large});
  side.gateway.apply(DestroyMirror{kMirror});
  side.drain_for(200ms);
  EXPECT_EQ(0u, side.gateway.counters().published);
  EXPECT_FALSE(side.next<PublishFailed>(0ms));
}

// Small ones behind a large one wait for it: so many, and not one more.
TEST_F(MessageSizeTest, OnlySoManyWaitBehindALargeOne) {
  TestSide side("connect_server");
  side.gateway.apply(CreateMirror{kMirror, topic("chatter"), kString, "", qos_of_depth(1)});
  const Payload tiny = Payload::adopt(string_message("tiny"));
  constexpr std::uint64_t kTiny = 100000;
  constexpr std::uint64_t kWaiting = SampleCheck::kBytesMax / SampleCheck::kSampleCost;
  side.gateway.apply(Publish{kMirror, Payload::adopt(string_message(std::string(2 << 20, 'x')))});
  for (std::uint64_t n = 0; n < kTiny; ++n) side.gateway.apply(Publish{kMirror, tiny});
  const auto published = [&] { return side.gateway.counters().published; };
  EXPECT_GE(published(), kTiny - kWaiting);
  EXPECT_LT(published(), kTiny) << "none waits: this shows nothing";
  EXPECT_TRUE(side.until([&] { return published() == kTiny + 1; }));
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
