// The topics of one peer together: what it may offer, its demands, what is decompressed at once.
#include "core/mirrors/link_topics.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "unit/mirrors/peer_topic_script.hpp"

namespace connect_bridge::topics_test {
namespace {

constexpr std::uint32_t kMiB = 1 << 20;

struct PeerScript : OfferedScript {
  using OfferedScript::OfferedScript;

  // A topic with an origin of its own.
  void offer_topic(std::uint32_t number, const std::string& name, const std::string& type = kType,
                   bool resume = false) {
    one.link.expect_offered({number}, InterfaceKind::kTopic);
    ChannelOffer offered =
        channel(number, name, {origin(1, static_cast<std::uint8_t>(number + 10))});
    offered.type = type;
    offered.resume = resume;
    peer.on_offer(offered, ms(0));
  }
  void withdraw(std::uint32_t number) {
    one.link.incoming({number})->channel->on_withdraw({}, ms(0));
    one.link.forget({number});
  }
  // Somebody listens to these.
  void listen_to(const std::vector<std::string>& heard) {
    std::vector<Topic> topics;
    for (const auto& name : heard) topics.push_back(topic(name).sub(50));
    graph = picture(topics);
    for (auto& [key, mirror] : context.mirrors.all()) mirror.update(ms(0));
  }
  std::string demands() {
    peer.send_demands();
    return one.said();
  }
  [[nodiscard]] std::string topics() const {
    LinkStatus status;
    peer.add_status(status);
    std::string words;
    for (const auto& shown : status.topics) words += (words.empty() ? "" : " ") + shown.topic;
    return words;
  }
};

// It stays without an owner: the peer learns that only when it has sent some more.
TEST(LinkTopics, WhatComesOnADeclinedChannelIsNoErrorOfThePeer) {
  PeerScript s;
  s.policy = Policy({rule({}, {"/b"})});
  s.offer_topic(1, "/a");
  EXPECT_EQ(s.one.said(), "decline 1 not_permitted\n");
  EXPECT_TRUE(s.one.link.expects({1}));
  EXPECT_FALSE(s.one.link.incoming({1})->channel);
}

TEST(LinkTopics, ANameHereBelongsToTheNameThatItIsMappedTo) {
  PeerScript s;
  s.one.link.names = NameMap("/robot", {{"/far", "/robot/near"}});
  s.offer_topic(1, "/near");
  EXPECT_EQ(s.one.said(), "decline 1 not_permitted\n");
  s.offer_topic(2, "/far");
  s.offer_topic(3, "/b");
  EXPECT_EQ(s.one.said(), "");
  EXPECT_EQ(s.topics(), "/robot/near /robot/b");
}

// Or a second channel would double what a rule allows.
TEST(LinkTopics, ATopicHasOneChannelUntilThatEnds) {
  PeerScript s;
  s.offer_topic(1, "/a");
  s.offer_topic(2, "/a");
  s.offer_topic(3, "/a", "p/msg/U");  // another topic
  EXPECT_EQ(s.one.said(), "decline 2 limit\n");
  s.withdraw(1);
  s.offer_topic(4, "/a");
  EXPECT_EQ(s.one.said(), "");
  s.offer_topic(5, "/a");
  EXPECT_EQ(s.one.said(), "decline 5 limit\n");
}

TEST(LinkTopics, NewRulesEndWhatTheyDoNotAllowAndNothingElse) {
  PeerScript s;
  for (const auto& [number, name] : {std::pair{1U, "/a"}, {2U, "/b"}, {3U, "/c"}})
    s.offer_topic(number, name);
  s.policy = Policy({rule({}, {"/b"})});
  s.peer.recheck(ms(0));
  EXPECT_EQ(s.one.said(), "decline 1 not_permitted\ndecline 3 not_permitted\n");
  EXPECT_EQ(s.topics(), "/b");
  s.peer.recheck(ms(0));
  EXPECT_EQ(s.one.said(), "");
  s.policy = Policy({everything()});
  s.offer_topic(4, "/a");  // the name is free
  EXPECT_EQ(s.topics(), "/b /a");
}

TEST(LinkTopics, ALostConnectionTakesSoManyChannelsInOneStep) {
  PeerScript s;
  for (std::uint32_t n = 1; n <= 3; ++n) s.offer_topic(n, "/t" + std::to_string(n));
  LinkEnd end;
  end.left = 2;
  EXPECT_FALSE(s.peer.on_link_lost(end, ms(0)));
  EXPECT_EQ(s.topics(), "/t3");
  end.left = 1;
  EXPECT_TRUE(s.peer.on_link_lost(end, ms(0)));
  EXPECT_EQ(s.topics(), "");
}

TEST(LinkTopics, ALostConnectionTakesAllChannelsAndTheMirrorsWait) {
  PeerScript s;
  s.offer_topic(1, "/a");
  s.offer_topic(2, "/b");
  s.did();
  s.lose(s.peer);
  EXPECT_EQ(s.topics(), "");
  EXPECT_FALSE(s.one.link.incoming({1})->channel);
  EXPECT_EQ(s.context.mirrors.all().size(), 2U);
  for (const auto& [key, mirror] : s.context.mirrors.all())
    EXPECT_EQ(mirror.candidates().front().offered, nullptr);
  EXPECT_EQ(s.did(), "");
  s.offer_topic(3, "/a");
  EXPECT_EQ(s.topics(), "/a");
}

// ---- demands

TEST(LinkTopics, DemandsThatBeginTogetherAreToldTogether) {
  PeerScript s;
  for (const auto& [number, name] : {std::pair{1U, "/a"}, {2U, "/b"}, {3U, "/c"}})
    s.offer_topic(number, name);
  s.listen_to({"/a", "/b"});
  EXPECT_EQ(s.demands(), "demand 1 2 on\n");
  EXPECT_EQ(s.demands(), "");  // once
  s.listen_to({"/b", "/c"});
  EXPECT_EQ(s.demands(), "demand 1 off\ndemand 3 on\n");
}

TEST(LinkTopics, WhatChangesBackBeforeItIsToldIsNotTold) {
  PeerScript s;
  s.offer_topic(1, "/a");
  s.listen_to({"/a"});
  s.listen_to({});
  EXPECT_EQ(s.demands(), "");
  s.listen_to({"/a"});
  EXPECT_EQ(s.demands(), "demand 1 on\n");
  s.listen_to({});
  s.listen_to({"/a"});
  EXPECT_EQ(s.demands(), "");
  EXPECT_TRUE(s.one.link.incoming({1})->channel->wants(1));
}

TEST(LinkTopics, NothingIsDemandedOfAChannelThatWasWithdrawnMeanwhile) {
  PeerScript s;
  s.offer_topic(1, "/a");
  s.offer_topic(2, "/b");
  s.listen_to({"/a", "/b"});
  s.withdraw(1);
  EXPECT_EQ(s.demands(), "demand 2 on\n");
}

// The exporter's channels of one demand have one number, however they begin.
TEST(LinkTopics, WhatIsKeptAndWhatGoesOnIsDemandedApart) {
  PeerScript s(std::chrono::seconds(10));
  s.one.link.arrived[{"/on", kType}] = {7};
  s.one.link.arrived[{"/unkept", kType}] = {8};
  s.offer_topic(1, "/cmd_vel", "geometry_msgs/msg/Twist");
  s.offer_topic(2, "/on", kType, true);
  s.offer_topic(3, "/fresh");
  s.offer_topic(4, "/unkept");
  Topic steered = topic("/cmd_vel").sub(50);
  steered.type = "geometry_msgs/msg/Twist";
  s.graph =
      picture({steered, topic("/on").sub(50), topic("/fresh").sub(50), topic("/unkept").sub(50)});
  for (auto& [key, mirror] : s.context.mirrors.all()) mirror.update(ms(0));
  s.pass_to(1000);  // what goes on waits until subscribers have found its mirror
  s.peer.send_demands();
  std::string words;
  while (const auto packet = s.one.link.connection()->next_packet(ms(0))) {
    const auto demand = demand_of(*packet);
    if (!demand) continue;
    for (const auto& channel : demand->channels) EXPECT_EQ(channel.number, 1U);
    words += line_of(*packet) + "\n";
  }
  EXPECT_EQ(words, "demand 1 on live\ndemand 3 4 on resume\ndemand 2 on resume after 7\n");
  EXPECT_TRUE(s.one.link.arrived.empty());  // it goes on once
}

// 0 is the end of a demand.
TEST(LinkTopics, DemandsAreCountedPastZero) {
  PeerScript s;
  s.offer_topic(1, "/a");
  s.listen_to({"/a"});
  const PeerTopic& offered = *s.context.mirrors.all().begin()->second.candidates().front().offered;
  const auto next = [&] {
    s.peer.send_demands();
    std::uint16_t number = 0;
    while (const auto packet = s.one.link.connection()->next_packet(ms(0)))
      if (const auto demand = demand_of(*packet); demand && demand->channels.front().number)
        number = demand->channels.front().number;
    s.peer.change_demand(offered, false);
    s.peer.send_demands();
    s.peer.change_demand(offered, true);
    return number;
  };
  for (std::uint32_t n = 1; n <= 65'535; ++n) ASSERT_EQ(next(), n);
  EXPECT_EQ(next(), 1U);
}

// ---- at once

InMessage of_size(std::uint32_t raw_bytes) {
  InMessage message = Importing::message("");
  message.codec = Codec::kZstd;
  message.raw_bytes = raw_bytes;
  message.body = Payload::adopt(compress(Bytes(raw_bytes, 7), {Codec::kZstd, 1}).value());
  return message;
}

// A peer that withdraws all it has sent must not make everything else wait.
TEST(LinkTopics, OnlySoMuchIsDecompressedAtOnce) {
  PeerScript s;
  const InMessage half = of_size(8 * kMiB);
  EXPECT_EQ(s.peer.decompress_at_once(half, ms(0))->size(), 8 * kMiB);
  EXPECT_TRUE(s.peer.decompress_at_once(half, ms(0)));
  EXPECT_FALSE(s.peer.decompress_at_once(of_size(1000), ms(0)));
  EXPECT_TRUE(s.peer.decompress_at_once(s.message("costs nothing"), ms(0)));
  EXPECT_FALSE(s.peer.decompress_at_once(half, ms(499)));
  EXPECT_TRUE(s.peer.decompress_at_once(half, ms(500)));
  EXPECT_FALSE(s.peer.decompress_at_once(of_size(16 * kMiB + 1), ms(100'000)));
  InMessage columns = half;
  columns.codec = Codec::kPlanes;
  EXPECT_FALSE(s.peer.decompress_at_once(columns, ms(200'000)));
  EXPECT_TRUE(s.peer.decompress_at_once(half, ms(200'000)));
  EXPECT_TRUE(s.peer.decompress_at_once(half, ms(200'000))) << "it was not even tried";
}

TEST(LinkTopics, WhatDoesNotDecompressHasCostItsTimeToo) {
  PeerScript s;
  InMessage odd = of_size(1000);
  odd.raw_bytes = 16 * kMiB;
  EXPECT_FALSE(s.peer.decompress_at_once(odd, ms(0)));
  EXPECT_FALSE(s.peer.decompress_at_once(of_size(1000), ms(0)));
}

// What a lost connection brought last does not come again, whatever was withdrawn before.
TEST(LinkTopics, AtTheEndOfTheConnectionThereIsTimeAgain) {
  PeerScript s;
  EXPECT_TRUE(s.peer.decompress_at_once(of_size(16 * kMiB), ms(0)));
  s.peer.finish(ms(0));
  EXPECT_TRUE(s.peer.decompress_at_once(of_size(16 * kMiB), ms(0)));
  EXPECT_FALSE(s.peer.decompress_at_once(of_size(1000), ms(0)));
}

// ---- origins without a place

TEST(LinkTopics, AnOriginThatWasLeftOutGetsThePlaceOfOneThatEnds) {
  PeerScript s;
  s.options.topic_mirrors_max = 1;
  s.offer(s.peer, {origin(1, 7), origin(2, 8), origin(3, 9)});
  EXPECT_EQ(s.did(), "mirror 1 /a reliable volatile 10\n");
  EXPECT_EQ(s.context.looks_again_at, ms(1000).steady);
  s.context.looks_again_at.reset();
  s.peer.try_left_out(64, ms(1000));
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.context.looks_again_at, ms(2000).steady);
  EXPECT_TRUE(s.channel_1().on_origins({{1}, {}, {{1}, {2}}}, ms(1500)));
  s.pass_to(1700);  // the mirror of the first is gone
  s.did();
  s.peer.try_left_out(64, ms(2000));
  EXPECT_EQ(s.did(), "mirror 2 /a reliable volatile 10\n");
  EXPECT_TRUE(s.context.mirrors.all().contains(
      MirrorKey{{"/a", kType}, gid(9)}));  // 8 is not offered any longer
  s.context.looks_again_at.reset();
  s.peer.try_left_out(64, ms(3000));
  EXPECT_FALSE(s.context.looks_again_at);
}

// All of them in one step would hold up everybody, each second.
TEST(LinkTopics, OfManyTopicsWithoutAPlaceFewLookAtOnceAndEachInItsTurn) {
  PeerScript s;
  s.options.mirrors_max = 0;
  for (std::uint32_t n = 1; n <= 150; ++n) s.offer_topic(n, "/t" + std::to_string(n));
  EXPECT_EQ(s.context.mirrors.all().size(), 0U);
  const auto look = [&](std::int64_t at) {
    s.context.looks_again_at.reset();
    s.peer.try_left_out(64, ms(at));
    return s.context.mirrors.all().size();
  };
  EXPECT_EQ(look(1000), 0U);
  EXPECT_EQ(s.context.looks_again_at, ms(2000).steady);
  s.options.mirrors_max = 150;
  EXPECT_EQ(look(2000), 64U);
  EXPECT_TRUE(s.context.mirrors.all().contains(MirrorKey{{"/t65", kType}, gid(75)}));
  EXPECT_FALSE(s.context.mirrors.all().contains(MirrorKey{{"/t64", kType}, gid(74)}));
  EXPECT_EQ(s.context.looks_again_at, ms(2010).steady);
  EXPECT_EQ(look(2010), 128U);
  EXPECT_EQ(look(2020), 150U);
  EXPECT_FALSE(s.context.looks_again_at);
}

}  // namespace
}  // namespace connect_bridge::topics_test
