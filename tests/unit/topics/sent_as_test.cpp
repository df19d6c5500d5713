// The form in which pictures and clouds leave: by the demand, both ends' rules and the path.
#include <gtest/gtest.h>

#include "core/media/sample_codec.hpp"
#include "core/topics/topic_offers.hpp"
#include "unit/media/samples.hpp"
#include "unit/mirrors/peer_topic_script.hpp"
#include "unit/topics/exporting.hpp"

namespace connect_bridge::topics_test {
namespace {

constexpr char kImage[] = "sensor_msgs/msg/Image";
constexpr char kCloud[] = "sensor_msgs/msg/PointCloud2";
constexpr std::size_t kMegabyte = 1'000'000;
constexpr std::size_t kFarTooMuch = 200'000'000;  // nothing of that size is made, only asked about

Rule media_rule() {
  Rule rule = everything();
  rule.treatment.compression.automatic = true;
  rule.treatment.keep = Keep::kNewest;
  return rule;
}

ChannelDemand demand_for(Decodes decodes, bool lossy = true) {
  return {.channel = {1}, .number = 1, .decodes = decodes, .lossy = lossy};
}
constexpr Decodes kAll{.vp8 = false, .cloud = true, .planes = true};

Bytes cloud_bytes() {
  media::TestCloud cloud{1, 500, media::kXyzi, 16, 8000, Bytes(8000)};
  for (std::size_t i = 0; i < 2000; ++i)
    media::set_float(0.001F * static_cast<float>(i % 77), cloud.data, 4 * i);
  return media::cloud_sample(cloud);
}

// One link that demands /a, and has carried one of its messages, slowly.
struct Sending {
  Sending(const char* type, const ChannelDemand& demand, const Rule& rule = media_rule(),
          const Qos& qos = side_test::qos(10))
      : s({rule}, type) {
    Topic state = topic("/a").pub(1, qos);
    state.type = type;
    s.see(state);
    subject.on_subscribed(qos);
    EXPECT_TRUE(offer.open());
    offer.on_demand(demand, ms(0));
    carry();
    EXPECT_TRUE(offer.channel_rate(ms(now)).is_shown);
    s.did();
  }
  // 100 kB, a window in each 400 ms.
  void carry() {
    const OutSample taken{
        OriginId{1}, flow_test::at_ms(now), 0, Payload::adopt(Bytes(100'000)), {}};
    offer.send(taken, Codec::kNone, taken.raw, ms(now));
    for (int round = 0; round < 100 && !offer.drained(); ++round) {
      while (peer.link.connection()->next_packet(ms(now))) {
      }
      now += 400;
      acknowledged += peer.link.outbox().unacknowledged_bytes();
      EXPECT_TRUE(peer.link.sending().acknowledge({acknowledged, flow_test::at_ms(now)}, ms(now)));
    }
    EXPECT_TRUE(offer.drained());
  }

  // The way of the last of so many samples, ten a second.
  Compression way(int samples = 1, std::size_t bytes = kFarTooMuch) {
    Compression how;
    for (int i = 0; i < samples; ++i) how = subject.way_to(offer, bytes, ms(now += 100));
    return how;
  }

  OneLink peer;
  Exporting s;
  TopicOffers subject{s.context, {s.context.timers, &s.subject}};
  TopicOffer& offer = subject.add(s.subject, peer.link);
  std::int64_t now = 100;
  std::uint64_t acknowledged = 0;
};

// ---- exact forms, where the demand names them

TEST(SentAs, APictureLeavesAsPlanesWhereTheyAreDecoded) {
  EXPECT_EQ(Sending(kImage, demand_for(kAll)).way(), (Compression{Codec::kPlanes, 1, true}));
  EXPECT_EQ(Sending(kImage, demand_for({.cloud = true})).way().codec, Codec::kZstd);
  EXPECT_EQ(Sending(kImage, demand_for({})).way().codec, Codec::kZstd);
  EXPECT_EQ(Sending(kType, demand_for(kAll)).way().codec, Codec::kZstd);
}

TEST(SentAs, ACloudLeavesByItsFieldsWhereTheyAreDecoded) {
  EXPECT_EQ(Sending(kCloud, demand_for(kAll, false)).way(10),
            (Compression{Codec::kCloud, 1, true}));
  EXPECT_EQ(Sending(kCloud, demand_for({.planes = true})).way(10).codec, Codec::kZstd);
}

TEST(SentAs, ARuleThatNamesACompressionHasIt) {
  for (const Compression& how : {Compression{Codec::kLz4}, Compression{}}) {
    Rule rule = media_rule();
    rule.treatment.compression = how;
    EXPECT_EQ(Sending(kImage, demand_for(kAll), rule).way(), how);
    EXPECT_EQ(Sending(kCloud, demand_for(kAll), rule).way(10), how);
  }
}

// ---- lossy

TEST(SentAs, CloudsAreRoundedWhereTooFewExactOnesFit) {
  Sending s(kCloud, demand_for(kAll));
  EXPECT_EQ(s.way(), (Compression{Codec::kCloud, 1, true}));  // of one, nothing is known
  EXPECT_EQ(s.way(), (Compression{Codec::kCloud, 1, true, 10'000}));
  Sending enough(kCloud, demand_for(kAll));
  const auto six_a_second =
      static_cast<std::size_t>(enough.offer.channel_rate(ms(enough.now)).rate / 6);
  EXPECT_EQ(enough.way(10, 2 * six_a_second).step_um, 0U);  // an exact one is thought to be half
}

TEST(SentAs, NeverAtEitherEndIsNever) {
  Rule never = media_rule();
  never.treatment.lossy = Lossy::kNever;
  EXPECT_EQ(Sending(kCloud, demand_for(kAll), never).way(10).step_um, 0U);
  EXPECT_EQ(Sending(kCloud, demand_for(kAll, false)).way(10).step_um, 0U);
}

TEST(SentAs, WhatMustAllArriveIsExact) {
  Rule all = media_rule();
  all.treatment.keep = Keep::kAll;
  EXPECT_EQ(Sending(kCloud, demand_for(kAll), all).way(10).step_um, 0U);
  Rule resumed = media_rule();
  resumed.treatment.resume = true;
  EXPECT_EQ(Sending(kCloud, demand_for(kAll), resumed).way(10).step_um, 0U);
  EXPECT_EQ(Sending(kCloud, demand_for(kAll), media_rule(), latched()).way(10).step_um, 0U);
}

TEST(SentAs, TheRuleSaysHowFarAPointMayMove) {
  Rule rule = media_rule();
  rule.treatment.max_error = 0.0005;
  EXPECT_EQ(Sending(kCloud, demand_for(kAll), rule).way(10).step_um, 1000U);
}

TEST(SentAs, AGridThinsByTheRuleWhateverTheLinkCarries) {
  Rule rule = media_rule();
  rule.treatment.grid = 0.1;
  EXPECT_EQ(Sending(kCloud, demand_for(kAll), rule).way(1, 500),
            (Compression{Codec::kCloud, 1, true, 0, 100'000}));
  EXPECT_EQ(Sending(kCloud, demand_for(kAll, false), rule).way(1, 500), Compression{});
  rule.treatment.lossy = Lossy::kNever;
  EXPECT_EQ(Sending(kCloud, demand_for(kAll), rule).way(1, 500), Compression{});
}

// The subscription is volatile, as one publisher is.
TEST(SentAs, WithALatchedPublisherAllIsExact) {
  Sending s(kCloud, demand_for(kAll));
  EXPECT_EQ(s.way(10).step_um, 10'000U);
  Topic both = topic("/a").pub(1, side_test::qos(10)).pub(2, latched());
  both.type = kCloud;
  s.s.see(both);
  EXPECT_EQ(s.way(10).step_um, 0U);
}

// A worker has a rounded one: the link does without it.
TEST(SentAs, WhatMustBeExactFromNowOnDoesNotWaitBehindARoundedOne) {
  Sending s(kCloud, demand_for(kAll));
  const Compression rounded = s.way(2);
  EXPECT_TRUE(rounded.loses());
  OutSample taken{OriginId{1},
                  flow_test::at_ms(s.now),
                  0,
                  sample(std::string(kMegabyte, 'x')),
                  {s.peer.link.id}};
  taken.taken = ms(s.now).steady;
  s.subject.encode(rounded, std::move(taken), ms(s.now));
  EXPECT_EQ(s.s.did(), "compress 1\n");
  Topic both = topic("/a").pub(1, side_test::qos(10)).pub(2, latched());
  both.type = kCloud;
  s.s.see(both);
  EXPECT_EQ(s.way().step_um, 0U);
}

TEST(SentAs, AThinnedCloudIsSaidInTheStatus) {
  Sending s(kCloud, demand_for(kAll));
  const Bytes raw = cloud_bytes();
  const auto body = media::encode_sample(raw, {Codec::kCloud, 1, false, 0, 10'000'000}).value();
  const OutSample taken{OriginId{1}, flow_test::at_ms(s.now), 0, Payload::adopt(Bytes(raw)), {}};
  s.offer.send(taken, Codec::kCloud, Payload::adopt(Bytes(body)), ms(s.now));
  LinkStatus status;
  s.offer.add_status(status);
  EXPECT_NE(status.topics.at(0).sent_as.because.find("grid"), std::string::npos);
  EXPECT_EQ(status.topics.at(0).sent_as.step_um, 0U);
  s.s.did();
  EXPECT_NE(s.s.logged.find("`grid`"), std::string::npos);
}

// What waits in the form of before gives way; what a worker has does not, so that order is kept.
TEST(SentAs, AnotherStepDropsWhatWaitsInTheFormerOne) {
  Sending s(kCloud, demand_for(kAll));
  const auto give = [&](const Compression& how) {
    OutSample taken{OriginId{1},
                    flow_test::at_ms(s.now),
                    0,
                    sample(std::string(kMegabyte, 'x')),
                    {s.peer.link.id}};
    taken.state = 1;
    taken.taken = ms(s.now).steady;
    s.subject.encode(how, std::move(taken), ms(s.now));
  };
  const Compression exact = s.way();
  give(exact);  // the worker's
  EXPECT_EQ(s.s.did(), "compress 1\n");
  EXPECT_EQ(s.way(), exact);
  give(exact);  // waits
  s.s.finish(Payload::adopt(Bytes(900'000)), s.now);
  EXPECT_EQ(s.s.did(), "");  // its link has enough to send
  EXPECT_EQ(s.way().step_um, 10'000U);
  EXPECT_EQ(s.subject.bytes(), 0U);
  LinkStatus status;
  s.offer.add_status(status);
  EXPECT_EQ(status.topics.at(0).dropped.of(DropReason::kNewerAvailable), 1U);
}

// ---- the importer

struct Receiving : OfferedScript {
  explicit Receiving(const Rule& rule = media_rule()) {
    policy = Policy({rule});
    Topic state = topic("/a").sub(50);
    state.type = kCloud;
    graph = picture({state});
    one.link.expect_offered({1}, InterfaceKind::kTopic);
    ChannelOffer offered = channel(1, "/a", {origin(1, 7)});
    offered.type = kCloud;
    peer.on_offer(offered, ms(0));
    peer.send_demands();
    did();
  }
  void adopt(const Rule& rule) {
    policy = Policy({rule});
    peer.recheck(ms(0));
    peer.renew(ms(0));
    peer.send_demands();
  }
  Result<Nothing> give_cloud(std::uint32_t step_um, std::uint16_t demand = 1) {
    const Bytes raw = cloud_bytes();
    InMessage result = message("", demand);
    result.codec = Codec::kCloud;
    result.raw_bytes = static_cast<std::uint32_t>(raw.size());
    const Compression how{Codec::kCloud, 1, false, step_um};
    result.body = Payload::adopt(media::encode_sample(raw, how).value());
    return channel_1().on_message(std::move(result), ms(0));
  }
  SentAs sent_as() const {
    LinkStatus status;
    peer.add_status(status);
    return status.topics.at(0).sent_as;
  }
};

TEST(SentAs, ARoundedCloudIsPublishedAndSaidInTheStatus) {
  Receiving s;
  ASSERT_TRUE(s.give_cloud(5000));
  EXPECT_EQ(s.did(), "decompress 1\n");
  EXPECT_EQ(s.sent_as().step_um, 5000U);
  EXPECT_NE(s.logged.find("rounded"), std::string::npos);
  ASSERT_TRUE(s.give_cloud(0));
  EXPECT_EQ(s.sent_as().codec, Codec::kCloud);
  EXPECT_EQ(s.sent_as().step_um, 0U);
}

TEST(SentAs, ARuleThatForbidsItFromNowOnMakesANewDemand) {
  Receiving s;
  EXPECT_EQ(s.one.said(), "demand 1 on\n");
  Rule another = media_rule();
  another.treatment.max_error = 0.001;
  s.adopt(another);
  EXPECT_EQ(s.one.said(), "");
  another.treatment.lossy = Lossy::kNever;
  s.adopt(another);
  EXPECT_EQ(s.one.said(), "demand 1 off\n");
  s.pass_to(10'000);
  s.peer.send_demands();
  EXPECT_EQ(s.one.said(), "demand 1 on\n");
  EXPECT_TRUE(s.give_cloud(0, 2));
  EXPECT_FALSE(s.give_cloud(1000, 2));
}

TEST(SentAs, ARoundedCloudThatNobodyAllowedEndsTheLink) {
  Rule never = media_rule();
  never.treatment.lossy = Lossy::kNever;
  Receiving s(never);
  EXPECT_TRUE(s.give_cloud(0));
  const auto refused = s.give_cloud(1000);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, CloseCode::kMalformed);
}

}  // namespace
}  // namespace connect_bridge::topics_test
