#include "core/mirrors/peer_topic.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "core/compress/compress.hpp"
#include "unit/mirrors/peer_topic_script.hpp"

namespace connect_bridge::topics_test {
namespace {

TEST(PeerTopic, IsDemandedWhileSomebodyListens) {
  OfferedScript s;
  s.offer(s.peer, {origin(1, 7)});
  EXPECT_EQ(s.did(), "mirror 1 /a reliable volatile 10\n");
  s.peer.send_demands();
  EXPECT_EQ(s.one.said(), "");
  s.listen();
  s.mirror(7).update(ms(0));
  s.peer.send_demands();
  EXPECT_EQ(s.one.said(), "demand 1 on\n");
  s.give(s.message("hello", 1));
  EXPECT_EQ(s.did(), "publish 1 hello\n");
}

TEST(PeerTopic, WhatAnEarlierDemandBroughtIsDropped) {
  OfferedScript s;
  s.listen();
  s.offer(s.peer, {origin(1, 7)});
  s.peer.send_demands();
  s.did();
  s.give(s.large(1));
  EXPECT_EQ(s.did(), "decompress 1\n");
  s.graph = picture({});
  s.mirror(7).update(ms(0));
  s.peer.send_demands();
  EXPECT_EQ(s.peer.decoding().used(), 0U);
  s.listen();
  s.mirror(7).update(ms(0));
  s.peer.send_demands();
  EXPECT_EQ(s.one.said(), "demand 1 on\ndemand 1 off\ndemand 1 on\n");
  s.finish(sample("large"));
  s.give(s.message("under way", 1));
  s.give(s.message("hello", 2));
  EXPECT_EQ(s.did(), "cancel 1\npublish 1 hello\n");
  EXPECT_EQ(s.dropped(DropReason::kNoDemand), 2U);
}

// A small message may have come in a packet of a megabyte, of which nobody would know.
TEST(PeerTopic, WhatWaitsDoesNotKeepItsPacket) {
  OfferedScript s;
  s.listen();
  s.offer(s.peer, {origin(1, 7)});
  s.peer.send_demands();
  s.give(s.large(1));
  InMessage message = s.message("small", 1);
  const auto packet =
      std::make_shared<Bytes>(message.body.view().begin(), message.body.view().end());
  message.body = Payload::wrap(packet, *packet);
  s.give(std::move(message));
  EXPECT_EQ(packet.use_count(), 1);
  s.did();
  s.finish(sample("large"));
  EXPECT_EQ(s.did(), "publish 1 large\npublish 1 small\n");
}

// However small they are: each costs memory beside its body.
TEST(PeerTopic, TinyMessagesBehindAJobAreBounded) {
  OfferedScript s;
  s.options.decoding_bytes_max = 100'000;
  s.listen();
  s.offer(s.peer, {origin(1, 7, latched())});
  s.peer.send_demands();
  s.give(s.large(1));
  for (int i = 0; i < 10'000; ++i) s.give(s.message("", 1));
  EXPECT_GT(s.dropped(DropReason::kQueueBytes), 8'000U);
  EXPECT_LE(s.peer.decoding().used(), 100'000U);
  EXPECT_GT(s.peer.decoding().used(), 90'000U);
}

TEST(PeerTopic, ADemandThatEndsBeforeItIsToldIsNotTold) {
  OfferedScript s;
  s.listen();
  s.offer(s.peer, {origin(1, 7)});
  s.graph = picture({});
  s.mirror(7).update(ms(0));
  s.peer.send_demands();
  EXPECT_EQ(s.one.said(), "");
  s.give(s.message("late"));
  EXPECT_EQ(s.dropped(DropReason::kNoDemand), 1U);
}

TEST(PeerTopic, WhatNoRuleAllowsIsDeclined) {
  OfferedScript s;
  s.policy = Policy({rule({}, {"/b"})});
  s.offer(s.peer, {origin(1, 7)});
  EXPECT_EQ(s.one.said(), "decline 1 not_permitted\n");
  EXPECT_FALSE(s.one.link.incoming({1})->channel);
  EXPECT_TRUE(s.one.link.expects({1}));
  EXPECT_EQ(s.did(), "");
}

TEST(PeerTopic, NewRulesEndIt) {
  OfferedScript s;
  s.listen();
  s.offer(s.peer, {origin(1, 7)});
  s.peer.send_demands();
  s.one.said();
  s.did();
  s.policy = Policy({rule({}, {"/b"})});
  s.peer.recheck(ms(0));
  s.peer.send_demands();
  EXPECT_EQ(s.one.said(), "decline 1 not_permitted\ndemand 1 off\n");
  EXPECT_FALSE(s.one.link.incoming({1})->channel);
  s.pass_to(200);
  EXPECT_EQ(s.did(), "unmirror 1\n");
}

TEST(PeerTopic, NothingOvertakesWhatIsDecompressed) {
  OfferedScript s;
  s.listen();
  s.offer(s.peer, {origin(1, 7)});
  s.did();
  s.give(s.large());
  s.give(s.message("small"));
  EXPECT_EQ(s.did(), "decompress 1\n");
  EXPECT_GT(s.peer.decoding().used(), 0U);
  s.finish(sample("large"));
  EXPECT_EQ(s.did(), "publish 1 large\npublish 1 small\n");
  EXPECT_EQ(s.peer.decoding().used(), 0U);
}

TEST(PeerTopic, BehindASlowWorkerNoMoreWaitThanTheOriginsDepth) {
  OfferedScript s;
  s.options.default_depth = 2;
  s.listen();
  s.offer(s.peer, {origin(1, 7, qos(3)), origin(2, 8, latched(1))});
  s.did();
  s.give(s.large());
  for (const char* text : {"a", "b", "c", "d"}) s.give(s.message(text));
  EXPECT_EQ(s.dropped(DropReason::kQueueDepth), 1U);
  auto kept = s.message("kept");  // of the transient-local one
  kept.subject = OriginId{2};
  s.give(std::move(kept));
  EXPECT_EQ(s.dropped(DropReason::kQueueDepth), 1U);
  EXPECT_EQ(s.did(), "decompress 1\n");
  s.finish(sample("large"));
  EXPECT_EQ(s.did(), "publish 1 large\npublish 1 b\npublish 1 c\npublish 1 d\npublish 2 kept\n");
}

// One that is kept as a base, or (with a base) refers to one.
InMessage delta(const std::string& text, const std::string& base = {}) {
  InMessage result = Importing::message(text);
  const Payload raw = sample(text);
  const Payload old = base.empty() ? Payload{} : sample(base);
  result.body = Payload::adopt(compress_delta(raw.view(), old.view(), 3).value());
  result.codec = base.empty() ? Codec::kZstdBase : Codec::kZstdDelta;
  return result;
}

const std::string kBase(100, 'a');
const std::string kNext = kBase + "b";

TEST(PeerTopic, WhatRefersToTheLastOneIsRead) {
  OfferedScript s;
  s.listen();
  s.offer(s.peer, {origin(1, 7)});
  s.did();
  s.give(delta(kBase));
  s.give(delta(kNext, kBase));
  EXPECT_EQ(s.did(), "publish 1 " + kBase + "\npublish 1 " + kNext + "\n");
  EXPECT_GT(s.peer.bases().used(), 0U);
  // Also while others are with a worker, behind which it comes.
  s.give(s.large());
  s.give(delta(kBase, kNext));
  EXPECT_EQ(s.did(), "decompress 1\n");
  s.finish(sample("large"));
  EXPECT_EQ(s.did(), "publish 1 large\npublish 1 " + kBase + "\n");
}

TEST(PeerTopic, AFormThatTheDemandDoesNotNameIsRefused) {
  OfferedScript s;
  s.listen();
  s.offer(s.peer, {origin(1, 7)});
  s.did();
  for (const Codec codec :
       {Codec::kPictureBase, Codec::kPictureDelta, Codec::kCloud, Codec::kPlanes}) {
    auto message = s.message("a picture");
    message.codec = codec;
    const auto refused = s.channel_1().on_message(message, ms(0));
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, CloseCode::kMalformed);
    message.demand = 9;  // an earlier demand may have named it
    EXPECT_TRUE(s.channel_1().on_message(message, ms(0)));
  }
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.dropped(DropReason::kNoDemand), 4U);
}

TEST(PeerTopic, ABaseGoesWithItsOriginAndItsDemand) {
  OfferedScript s;
  s.listen();
  s.offer(s.peer, {origin(1, 7), origin(2, 8)});
  s.give(delta(kBase));
  EXPECT_TRUE(s.channel_1().on_origins({{1}, {}, {{1}}}, ms(0)));
  EXPECT_EQ(s.peer.bases().used(), 0U);
  const auto refused = s.channel_1().on_message(delta(kNext, kBase), ms(0));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, CloseCode::kMalformed);
  s.give(delta(kBase));
  EXPECT_GT(s.peer.bases().used(), 0U);
  s.peer.send_demands();  // it gets its number
  EXPECT_EQ(s.peer.bases().used(), 0U);
}

// Tiny bodies that decompress to much are decoded at a limited rate; a message that refers to a
// skipped one is dropped too.
TEST(PeerTopic, TinyDeltasDoNotBecomeGigabytes) {
  OfferedScript s;
  s.listen();
  s.offer(s.peer, {origin(1, 7)});
  const std::string large(32'000, 'a');
  s.give(delta(large));
  const InMessage next = delta(large, large);
  for (int i = 0; i < 28'000; ++i) s.give(next);
  s.did();
  EXPECT_GT(s.dropped(DropReason::kRate), 5000U);
}

TEST(PeerTopic, WhatDoesNotDecompressEndsTheLink) {
  OfferedScript s;
  s.listen();
  s.offer(s.peer, {origin(1, 7)});
  s.give(s.large());
  s.did();
  s.finish(std::nullopt);
  ASSERT_TRUE(s.one.link.connection()->failure());
  EXPECT_EQ(s.one.link.connection()->failure()->code, CloseCode::kMalformed);
}

// A rule's limits for a peer's rates apply at the importer, whatever the peer's own rules say.
TEST(PeerTopic, TheRuleLimitsTheRateOfWhatIsPublished) {
  Rule limited = everything();
  limited.treatment.max_rate = 10;
  OfferedScript s;
  s.policy = Policy({limited});
  s.listen();
  s.offer(s.peer, {origin(1, 7)});
  s.did();
  for (std::int64_t at = 0; at < 1000; at += 5) s.give(s.message("x"), at);
  EXPECT_EQ(s.dropped(DropReason::kRate), 189U);  // 10 and a little slack pass
  // Offering the topic again, or twice, does not give more.
  s.peer.on_offer(channel(2, "/a", {origin(1, 8)}), ms(1000));
  s.peer.send_demands();
  EXPECT_EQ(s.one.said(), "decline 2 limit\ndemand 1 on\n");
  s.channel_1().on_withdraw({}, ms(1000));
  s.offer(s.peer, {origin(1, 7)}, 1000);
  s.did();
  s.give(s.message("x"), 1000);
  s.give(s.message("y"), 1001);
  s.give(s.message("z"), 1002);
  EXPECT_EQ(s.dropped(DropReason::kRate), 1U);
  EXPECT_EQ(s.did(), "publish 1 x\n");
}

TEST(PeerTopic, ARateThatChangedWhileTheTopicWasNotOfferedHolds) {
  Rule limited = everything();
  limited.treatment.max_rate = 100;
  OfferedScript s;
  s.policy = Policy({limited});
  s.listen();
  s.offer(s.peer, {origin(1, 7)});
  s.give(s.message("x"), 0);
  s.channel_1().on_withdraw({}, ms(10));
  limited.treatment.max_rate = 1;
  s.policy = Policy({limited});
  s.offer(s.peer, {origin(1, 7)}, 20);
  s.did();
  for (std::int64_t at = 20; at < 1920; at += 20) s.give(s.message("x"), at);
  EXPECT_EQ(s.did(), "publish 1 x\npublish 1 x\n");
}

TEST(PeerTopic, TheRuleLimitsBytesPerSecond) {
  Rule limited = everything();
  limited.treatment.bytes_per_second_max = 1000;
  OfferedScript s;
  s.policy = Policy({limited});
  s.listen();
  s.offer(s.peer, {origin(1, 7)});
  s.did();
  for (std::int64_t at = 0; at < 1000; at += 10) s.give(s.message(std::string(96, 'x')), at);
  EXPECT_EQ(s.dropped(DropReason::kRate), 88U);  // and the newest waits
}

// A body that grows by thousands is decompressed at a limited rate: two kilobytes on the wire must
// not be gigabytes a second here.
TEST(PeerTopic, FewBytesDoNotBecomeGigabytes) {
  OfferedScript s;
  s.listen();
  s.offer(s.peer, {origin(1, 7)});
  s.did();
  InMessage bomb = s.message("");
  bomb.codec = Codec::kZstd;
  bomb.raw_bytes = 64 << 20;
  bomb.body = Payload::adopt(Bytes(2000, 0));
  std::string jobs;
  for (std::int64_t at = 0; at < 10'000; at += 10) {
    s.give(bomb, at);
    if (const std::string did = s.did(); !did.empty()) {
      jobs += did;
      s.finish(sample("large"), at);
      s.did();
    }
  }
  EXPECT_EQ(std::count(jobs.begin(), jobs.end(), '\n'), 2);
  EXPECT_EQ(s.dropped(DropReason::kRate), 998U);
  // Messages with a usual ratio are not held up by that.
  bomb.raw_bytes = 60'000;
  s.give(bomb, 10'000);
  EXPECT_EQ(s.did(), "decompress 3\n");
}

// They are published in one turn of the loop when the worker is done.
TEST(PeerTopic, NoMoreThanSoManyWaitBehindAJob) {
  OfferedScript s;
  s.listen();
  OriginOffer latched = origin(1, 7);
  latched.qos.durability = Durability::kTransientLocal;
  s.offer(s.peer, {latched});
  s.peer.send_demands();
  s.did();
  s.give(s.large(1));
  for (int n = 0; n < 2000; ++n) s.give(s.message("x", 1));
  EXPECT_EQ(s.dropped(DropReason::kQueueBytes), 2000U - 1023U);
}

TEST(PeerTopic, OriginsAreReplacedInOneMessage) {
  OfferedScript s;
  s.offer(s.peer, {origin(1, 7)});
  s.did();
  EXPECT_TRUE(s.channel_1().on_origins({{1}, {origin(2, 8)}, {{1}}}, ms(0)));
  EXPECT_EQ(s.did(), "mirror 2 /a reliable volatile 10\n");
  s.pass_to(200);
  EXPECT_EQ(s.did(), "unmirror 1\n");
}

TEST(PeerTopic, CountsWhatThePeerDropsBecauseOfOurLimit) {
  OfferedScript s;
  s.offer(s.peer, {origin(1, 7)});
  s.did();
  s.logged.clear();
  for (const std::uint64_t total : {1U, 5U, 5U, 2U})
    EXPECT_TRUE(s.channel_1().on_origins({{1}, {}, {}, total, 101}, ms(0)));
  EXPECT_EQ(s.dropped(DropReason::kTooLarge), 5U);
  s.did();
  EXPECT_EQ(s.logged,
            "/a: /peer at 10.0.0.1 drops messages of 101 bytes, which are larger than "
            "`max_message_size` here. A larger limit lets them come\n");
}

TEST(PeerTopic, MoreOriginsThanAllowedEndTheLink) {
  OfferedScript s;
  s.offer(s.peer, {});
  OriginsChanged change{{1}, {}, {}};
  for (std::uint32_t i = 1; i <= kChannelOriginsMax + 1; ++i)
    change.added.push_back(origin(i, static_cast<std::uint8_t>(i)));
  const auto result = s.channel_1().on_origins(change, ms(0));
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, CloseCode::kTooLarge);
}

}  // namespace
}  // namespace connect_bridge::topics_test
