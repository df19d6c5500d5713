// The peers' topics here: one mirror per origin, demanded by local subscribers.
#include <gtest/gtest.h>

#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

// A side that knows its graph for long (nothing waits for discovery), joined by link 1.
struct PeerTopics : Script {
  explicit PeerTopics(std::vector<Rule> rules = {everything()},
                      const std::vector<Topic>& topics = {})
      : Script(server(std::move(rules))) {
    graph(topics);
    pass(1000);
    join(1);
  }
  void offer(std::uint32_t connection, std::vector<ChannelOffer> channels, bool complete = false) {
    say(connection, Offer{std::move(channels), complete});
  }
};

TEST(SideImports, EveryOriginHasAMirrorWithItsQos) {
  PeerTopics s;
  s.offer(1, {channel(1, "/a", {origin(1, 11, qos(5)), origin(2, 12, best_effort(7))}),
              channel(2, "/map", {origin(1, 13, latched(0))})});
  EXPECT_EQ(s.did(),
            "mirror 2 /a reliable volatile 5\n"
            "mirror 3 /a best_effort volatile 7\n"
            "mirror 4 /map reliable latched 10\n"
            "claim [11 12 13]\n");
  EXPECT_EQ(s.said(1), "");  // nobody subscribes
}

TEST(SideImports, ATopicThatThePeerCannotServeGoesAndTheLogSaysWhy) {
  Script s(server());
  s.graph({topic("/a").sub(1)});
  s.pass(1000);
  s.join(1);
  s.say(1, Offer{{channel(1, "/a", {origin(1, 11)})}, true});
  s.did();
  s.logged.clear();
  for (int i = 0; i < 2; ++i) {
    s.say(1, Withdraw{{{1}}, "type_unknown", "the type p/msg/T is not known here"});
    s.say(1, Offer{{channel(1, "/a", {origin(1, 11)})}, false});
  }
  s.did();
  EXPECT_EQ(s.logged,
            "/peer at 10.0.0.1 cannot export /a, and says: the type p/msg/T is not known here "
            "(type_unknown)\n");
}

TEST(SideImports, WhatTheMiddlewareRefusesIsADrop) {
  PeerTopics s;
  s.offer(1, {channel(1, "/a", {origin(1, 11)})});
  s.graph({topic("/a").sub(1)});
  for (int i = 0; i < 3; ++i) s.message(1, 1, 1, "hello");
  s.give(PublishFailed{{2}, 2});
  s.give(PublishFailed{{99}, 1});  // a mirror that is gone
  EXPECT_EQ(s.dropped(DropReason::kPublishFailed), 2U);
  EXPECT_EQ(s.status().links.at(0).topics.at(0).messages, 1U);
}

TEST(SideImports, KindsOfLaterVersionsAreDeclined) {
  PeerTopics s;
  const std::string text =
      R"({"type":"offer","channels":[{"channel":1,"kind":"action","name":"/add"},)"
      R"({"channel":2,"kind":"hologram","name":"/h"}]})";
  s.give(PacketReceived{{1}, true, Payload::copy_of(Bytes(text.begin(), text.end()))});
  EXPECT_EQ(s.said(1), "decline 1 unsupported\ndecline 2 unsupported\n");
  EXPECT_EQ(s.did(), "");
}

TEST(SideImports, ChannelsHaveALimit) {
  auto options = server();
  options.channels_max = 2;
  Script s(options);
  s.graph({});
  s.join(1);
  s.say(1, Offer{{channel(1, "/a", {}), channel(2, "/b", {})}, true});
  EXPECT_EQ(s.did(), "");
  s.say(1, Offer{{channel(3, "/c", {})}, false});
  EXPECT_EQ(s.did(), "close 1 4006\n");
}

// Two links of one graph: the second one feeds the mirror of the other origin.
TEST(SideImports, ADemandEndsWithTheOnlyOriginThatWantedIt) {
  PeerTopics s({everything()}, {topic("/a").sub(1)});
  s.join(2);
  s.offer(2, {channel(1, "/a", {origin(1, 12)})});
  s.offer(1, {channel(1, "/a", {origin(1, 11), origin(2, 12)})});
  EXPECT_EQ(s.said(1), "demand 1 on\n");
  EXPECT_EQ(s.said(2), "demand 1 on\n");
  s.say(1, OriginsChanged{{1}, {}, {{1}}});
  EXPECT_EQ(s.said(1), "demand 1 off\n");
  EXPECT_EQ(s.said(2), "");
}

TEST(SideImports, AMirrorGoesWhenItsOriginAppearsHere) {
  PeerTopics s({everything()}, {topic("/a").sub(1)});
  s.offer(1, {channel(1, "/a", {origin(1, 11)})});
  EXPECT_EQ(s.did(), "mirror 2 /a reliable volatile 10\nclaim [11]\n");
  EXPECT_EQ(s.said(1), "demand 1 on\n");
  s.graph({topic("/a").pub(11).sub(1)});
  EXPECT_EQ(s.did(), "unmirror 2\nclaim []\n");
  EXPECT_EQ(s.said(1), "offer 1/a[1]\ndemand 1 off\n");
}

// A peer may send as many states as it likes, each twice.
TEST(SideImports, WhatARateHoldsIsPublishedInSeveralSteps) {
  Rule limited = everything();
  limited.treatment.max_rate = 1;
  PeerTopics s({limited}, {topic("/a").sub(1)});
  std::vector<OriginOffer> origins;
  for (std::uint8_t n = 1; n <= 100; ++n) origins.push_back(origin(n, 100 + n));
  s.Script::offer(1, {channel(1, "/a", origins)});
  s.said(1);
  s.pass(5000);  // subscribers have found the mirrors
  for (const char* text : {"passes", "held"})
    for (std::uint32_t n = 1; n <= 100; ++n) s.message(1, 1, n, text);
  s.did();
  s.at += 1000;
  const auto held = [&] {
    s.give(TimePassed{});
    const std::string did = s.did();
    std::size_t count = 0;
    for (auto at = did.find("held"); at != std::string::npos; at = did.find("held", at + 1))
      ++count;
    return count;
  };
  EXPECT_EQ(held(), 64U);
  EXPECT_LE(s.side.next_deadline(), flow_test::now_ms(s.at).steady);
  EXPECT_EQ(held(), 36U);
  EXPECT_EQ(held(), 0U);
}

}  // namespace
}  // namespace connect_bridge::side_test
