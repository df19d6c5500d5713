// Packets of a video on a link that carries less than is published: what leaves can be decoded.
#include "core/topics/packet_stream.hpp"

#include <gtest/gtest.h>

#include <string>

#include "core/topics/topic_offers.hpp"
#include "core/wire/frame.hpp"
#include "unit/flow/script.hpp"
#include "unit/media/samples.hpp"
#include "unit/topics/exporting.hpp"
#include "unit/topics/peer_topic_script.hpp"

namespace connect_bridge::topics_test {
namespace {

constexpr char kVideo[] = "foxglove_msgs/msg/CompressedVideo";

// A link that demands a video. Each packet has the time of its publication as its stamp.
struct Video {
  explicit Video(const Rule& rule = everything()) : s({rule}, kVideo, "/video") {
    Topic state = topic("/video").pub(1, side_test::qos(1));
    state.type = kVideo;
    s.graph = picture({state});
    s.options.history_bytes_max = 0;
    s.subject.on_graph(ms(0));
    s.graph = picture({state});
    subject.on_subscribed(side_test::qos(1));
    EXPECT_TRUE(offer.open());
    offer.on_demand({.channel = {1}, .number = 1}, ms(0));
    subject.note(offer);
  }
  void publish(std::int64_t at, bool key, std::size_t bytes = 100, std::string_view camera = "c") {
    Bytes data(bytes);
    data[0] = key ? 0 : 1;  // of VP8
    media::SampleWriter out;
    out.u32(1).u32(2).text(camera).octets(data).text("vp8");
    OutSample taken{OriginId{1}, flow_test::at_ms(at), 0, Payload::adopt(std::move(out.bytes)), {}};
    taken.taken = ms(at).steady;
    taken.state = 0;
    subject.send(taken, TopicOffer::Age::kNew, ms(at));
  }
  void pass_to(std::int64_t at) { offer.packets().on_time(ms(at)); }
  // The publication times of what leaves then.
  std::string leave(std::int64_t at) {
    std::string times;
    while (const auto packet = peer.link.connection()->next_packet(ms(at))) {
      if (packet->text) continue;
      const Bytes bytes = flow_test::joined(*packet);
      FrameReader reader(bytes);
      for (auto frame = reader.next(); frame && frame.value(); frame = reader.next())
        if (const auto* message = std::get_if<MessageFrame>(&*frame.value()))
          times += std::to_string((message->stamp - flow_test::at_ms(0)) / 1'000'000) + " ";
      peer.link.report_left(ms(at));
    }
    return times;
  }
  [[nodiscard]] TopicStatus status() const {
    LinkStatus link;
    offer.add_status(link);
    return link.topics.at(0);
  }

  OneLink peer;
  Exporting s;
  TopicOffers subject{s.context, {s.context.timers, &s.subject}};
  TopicOffer& offer = subject.add(s.subject, peer.link);
};

TEST(PacketStream, AllPacketsLeaveInOrderThoughThePublishersDepthIsOne) {
  Video video;
  for (int n = 0; n < 8; ++n) video.publish(10 * n, n == 0);
  EXPECT_EQ(video.status().queued, 8U);
  EXPECT_EQ(video.leave(100), "0 10 20 30 40 50 60 70 ");
  EXPECT_EQ(video.status().dropped.total(), 0U);
}

TEST(PacketStream, ANewGroupTakesThePlaceOfThoseThatWait) {
  Video video;
  for (int n = 0; n < 8; ++n) video.publish(10 * n, n % 5 == 0);
  EXPECT_EQ(video.leave(100), "0 50 60 70 ");
  EXPECT_EQ(video.status().dropped.of(DropReason::kNewerAvailable), 4U);
}

TEST(PacketStream, BehindALostPacketNothingLeavesUntilAKeyFrame) {
  Video video;
  video.publish(0, true);
  video.publish(100, false);
  video.publish(200, false);
  video.pass_to(1099);
  EXPECT_EQ(video.status().queued, 3U);
  video.pass_to(1100);  // one has waited for a second
  EXPECT_EQ(video.status().queued, 1U);
  video.publish(1150, false);
  EXPECT_EQ(video.leave(1160), "0 ");
  video.publish(1200, false);
  EXPECT_EQ(video.leave(1210), "");
  video.publish(1300, true);
  video.publish(1310, false);
  EXPECT_EQ(video.leave(1320), "1300 1310 ");
  EXPECT_EQ(video.status().dropped.of(DropReason::kNewerAvailable), 4U);
}

TEST(PacketStream, PacketsThatNeverCameBreakTheirGroupsToo) {
  Video video;
  video.publish(0, true);
  video.subject.miss(DropReason::kLostHere, 1);
  video.publish(10, false);
  video.publish(20, true);
  video.publish(30, false);
  EXPECT_EQ(video.leave(40), "0 20 30 ");
}

TEST(PacketStream, EachCameraOfAPublisherHasItsGroups) {
  Video video;
  video.publish(0, true, 100, "left");
  video.publish(1, true, 100, "right");
  video.publish(2, false, 100, "left");
  video.publish(3, true, 100, "right");
  EXPECT_EQ(video.leave(40), "0 2 3 ");
}

// One that is refused by a rate, or has no room.
TEST(PacketStream, ARefusedPacketBreaksItsGroup) {
  Rule rule = everything();
  rule.treatment.queue_bytes_max = 1'000'000;
  Video video(rule);
  video.publish(0, true);
  for (int n = 1; n <= 10; ++n) video.publish(n, false, 1 << 20);
  EXPECT_GT(video.status().dropped.of(DropReason::kQueueBytes), 0U);
  video.publish(20, false);
  EXPECT_EQ(video.leave(30), "0 ");
  video.publish(40, true);
  EXPECT_EQ(video.leave(50), "40 ");
}

TEST(PacketStream, WhoAsksForAllMessagesGetsThem) {
  Rule rule = everything();
  rule.treatment.keep = Keep::kAll;
  Video video(rule);
  for (int n = 0; n < 8; ++n) video.publish(10 * n, n % 5 == 0);
  EXPECT_EQ(video.leave(100), "0 10 20 30 40 50 60 70 ");
}

TEST(PacketStream, TheEndOfTheDemandLosesThem) {
  Video video;
  for (int n = 0; n < 3; ++n) video.publish(10 * n, n == 0);
  video.offer.on_demand({.channel = {1}, .number = 0}, ms(40));
  EXPECT_EQ(video.status().queued, 0U);
  EXPECT_EQ(video.status().dropped.of(DropReason::kNoDemand), 3U);
  EXPECT_TRUE(video.offer.drained());
}

}  // namespace
}  // namespace connect_bridge::topics_test
