// Pictures of cameras: when a sample becomes one, when it is encoded, and to which one it refers.
#include <gtest/gtest.h>

#include <algorithm>
#include <deque>

#include "core/topics/sample_content.hpp"
#include "core/topics/topic_offers.hpp"
#include "core/video/body.hpp"
#include "core/video/picture.hpp"
#include "unit/media/samples.hpp"
#include "unit/mirrors/peer_topic_script.hpp"
#include "unit/topics/exporting.hpp"

namespace connect_bridge::topics_test {
namespace {

constexpr char kPicture[] = "sensor_msgs/msg/Image";
constexpr Decodes kVp8{.vp8 = true, .cloud = false, .planes = false};

Rule camera_rule() {
  Rule rule = everything();
  rule.treatment.compression.automatic = true;
  rule.treatment.keep = Keep::kNewest;
  rule.treatment.lossy = Lossy::kAuto;
  return rule;
}

Bytes image(std::string_view encoding = "mono8") {
  return media::image_sample({200, 200, encoding, 200, false, Bytes(40'000)});
}

// A JPEG as large as the image, which nobody decodes here.
Bytes jpeg(std::string_view format = "jpeg") {
  Bytes data = media::jpeg_beginning({200, 200});
  data.resize(40'000);
  return media::compressed_sample(data, format);
}

struct Form {
  std::string topic = "/a";
  std::string type = kPicture;
  Bytes (*sample)(std::string_view) = [](std::string_view encoding) { return image(encoding); };
  std::string info = "/camera_info";
};
const Form kJpegs{"/camera/raw/compressed", "sensor_msgs/msg/CompressedImage",
                  [](std::string_view) { return jpeg(); }, "/camera/camera_info"};

// The head of a VP8 frame, and as many bytes behind it.
Bytes body_of(ByteView raw, bool base, std::size_t frame_bytes) {
  const auto sample = video::read_sample(raw);
  Bytes frame{static_cast<std::uint8_t>(base ? 0x10 : 0x11), 0, 0};
  if (base) {
    const auto size = sample->shape.coded(false);
    for (const std::uint32_t value : {0x9dU, 0x01U, 0x2aU, size.width & 0xffU, size.width >> 8U,
                                      size.height & 0xffU, size.height >> 8U})
      frame.push_back(static_cast<std::uint8_t>(value));
  }
  frame.resize(frame.size() + frame_bytes);
  video::PictureBody body;
  body.base = base;
  body.quantiser = 40;
  body.prefix = sample->prefix;
  body.frame = frame;
  body.shape = sample->shape;
  return video::write_body(body);
}

ChannelDemand wish(bool lossy = true, Decodes decodes = kVp8) {
  return {.channel = {1}, .number = 1, .decodes = decodes, .lossy = lossy};
}

// A link that demands the images of a topic.
struct Camera {
  explicit Camera(const Rule& rule = camera_rule(), const ChannelDemand& demand = wish(),
                  const Qos& qos = side_test::qos(10), bool with_info = false,
                  const std::shared_ptr<Account>& account = std::make_shared<Account>(),
                  const Form& of = {})
      : form(of), peer(1, account), s({rule}, of.type, of.topic) {
    s.options.pictures = true;
    Topic state = topic(of.topic).pub(1, qos);
    state.type = of.type;
    std::vector<Topic> topics{state};
    if (with_info) {
      Topic info = topic(of.info).pub(1, qos);
      info.type = "sensor_msgs/msg/CameraInfo";
      topics.push_back(info);
    }
    s.graph = picture(topics);
    s.subject.on_graph(ms(0));
    subject.on_subscribed(qos);
    EXPECT_TRUE(offer.open());
    offer.on_demand(demand, ms(0));
    subject.note(offer);
    s.did();
  }
  void publish(std::string_view encoding = "mono8", std::uint32_t origin = 1) {
    OutSample taken{OriginId{origin},
                    flow_test::at_ms(now),
                    ++number,
                    Payload::adopt(form.sample(encoding)),
                    {}};
    taken.taken = ms(now).steady;
    taken.order = number;
    const PacketFacts packet = packet_of(form.type, taken.raw.view());
    taken.video = packet.part;
    taken.camera = packet.camera;
    taken.node = company_node(node_of(s.graph.find({form.topic, form.type})->publishers.front()));
    subject.send(taken, TopicOffer::Age::kNew, ms(now));
  }
  // So many bytes leave and are acknowledged.
  void carry(std::size_t bytes) {
    for (std::size_t sent = 0; sent < bytes;) {
      const auto packet = peer.link.connection()->next_packet(ms(now));
      if (!packet) break;
      sent += packet->size();
      peer.link.report_left(ms(now));
    }
    acknowledged += peer.link.outbox().unacknowledged_bytes();
    EXPECT_TRUE(peer.link.sending().acknowledge({acknowledged, flow_test::at_ms(now)}, ms(now)));
  }
  // Samples at 20 Hz of which a packet leaves each 0.4 s, until that has shown that too few fit;
  // what the last of them did.
  std::string overload() {
    std::string did;
    for (int i = 0; i < 40 && did.find("encode") == std::string::npos; ++i) {
      now += 50;
      if (i % 8 == 0) carry(1);
      publish();
      did = s.did();
    }
    return did;
  }
  // The worker is done. What follows.
  std::string finish(bool base, std::size_t frame_bytes = 1'000) {
    s.finish(Payload::adopt(body_of(form.sample("mono8"), base, frame_bytes)), now);
    return s.did();
  }
  [[nodiscard]] TopicStatus status() const {
    LinkStatus link;
    offer.add_status(link);
    return link.topics.at(0);
  }

  Form form;
  OneLink peer;
  Exporting s;
  TopicOffers subject{s.context, {s.context.timers, &s.subject}};
  TopicOffer& offer = subject.add(s.subject, peer.link);
  std::int64_t now = 100;
  std::uint64_t number = 0;
  std::uint64_t acknowledged = 0;
};

TEST(PictureStream, BeginsWhereTooFewExactOnesFit) {
  Camera camera;
  EXPECT_EQ(camera.overload(), "encode 1 base\n");
  // The exact one under way would have held it up.
  EXPECT_EQ(camera.status().queued, 1U);
  EXPECT_GT(camera.status().dropped.of(DropReason::kNewerAvailable), 0U);
  camera.finish(true);
  EXPECT_EQ(camera.status().queued, 1U);
  EXPECT_EQ(camera.status().sent_as.codec, Codec::kPictureBase);
  EXPECT_EQ(camera.status().sent_as.quantiser, 40U);
  EXPECT_NE(camera.s.logged.find("as video"), std::string::npos);
}

Bytes large_image(std::string_view encoding) {
  return media::image_sample({1000, 1000, encoding, 1000, false, Bytes(1'000'000)});
}

// When the first picture is encoded of a camera whose 20 pictures a second begin at 0, over a path
// of this rate and delay, which a small message has shown; after 600 ms at the most.
std::int64_t first_encoded(std::int64_t bytes_per_ms, std::int64_t delay) {
  Camera camera(camera_rule(), wish(), side_test::qos(10), false, std::make_shared<Account>(),
                {"/a", kPicture, large_image, "/camera_info"});
  struct Arriving {
    std::uint64_t received = 0;
    std::int64_t at = 0;
  };
  std::deque<Arriving> arriving;
  Outbox& outbox = camera.peer.link.sending();
  outbox.add_channel({99}, {});
  outbox.push({99}, flow_test::message(100), ms(camera.now));
  while (camera.peer.link.connection()->next_packet(ms(camera.now))) {
  }
  std::uint64_t sent = outbox.unacknowledged_bytes();
  camera.now += 2 * delay;
  EXPECT_TRUE(outbox.acknowledge({sent, flow_test::at_ms(camera.now - delay)}, ms(camera.now)));
  std::int64_t free = 0;
  const std::int64_t begin = camera.now;
  for (; camera.now < begin + 600; ++camera.now) {
    if ((camera.now - begin) % 50 == 0) camera.publish();
    if (camera.s.did().find("encode") != std::string::npos) break;
    while (const auto packet = camera.peer.link.connection()->next_packet(ms(camera.now))) {
      sent += packet->size();
      free = std::max(free, camera.now) + static_cast<std::int64_t>(packet->size()) / bytes_per_ms;
      arriving.push_back({sent, free + delay});
    }
    for (; !arriving.empty() && arriving.front().at + delay <= camera.now; arriving.pop_front())
      EXPECT_TRUE(outbox.acknowledge(
          {arriving.front().received, flow_test::at_ms(arriving.front().at)}, ms(camera.now)));
  }
  return camera.now - begin;
}

// A path that has shown its end needs no second to tell that pictures are far too large.
TEST(PictureStream, BeginsSoonWhereFarTooFewFit) {
  EXPECT_LT(first_encoded(200, 30), 300);
  EXPECT_GE(first_encoded(200, 30), 100);
  // A long path carries little in its first round trips, whatever it could.
  EXPECT_GE(first_encoded(100'000, 500), 300);
}

TEST(PictureStream, OnlyWhereBothEndsAndTheSampleAllowIt) {
  Rule never = camera_rule();
  never.treatment.lossy = Lossy::kNever;
  EXPECT_EQ(Camera(never).overload(), "");
  EXPECT_EQ(Camera(camera_rule(), wish(false)).overload(), "");
  EXPECT_EQ(Camera(camera_rule(), wish(true, {})).overload(), "");
  Rule all = camera_rule();
  all.treatment.keep = Keep::kAll;
  EXPECT_EQ(Camera(all).overload(), "");
  Rule resumes = camera_rule();
  resumes.treatment.resume = true;
  EXPECT_EQ(Camera(resumes).overload(), "");
  EXPECT_EQ(Camera(camera_rule(), wish(), latched()).overload(), "");
}

// A mask is an Image, too.
TEST(PictureStream, WithoutARuleOnlyBesideACameraInfoOfTheNode) {
  Rule unset = camera_rule();
  unset.treatment.lossy.reset();
  EXPECT_EQ(Camera(unset).overload(), "");
  EXPECT_EQ(Camera(unset, wish(), side_test::qos(10), true).overload(), "encode 1 base\n");
}

Camera camera_of_jpegs(bool with_info) {
  Rule unset = camera_rule();
  unset.treatment.lossy.reset();
  return Camera(unset, wish(), side_test::qos(10), with_info, std::make_shared<Account>(), kJpegs);
}

// Its CameraInfo is beside the topic that it is a form of.
TEST(PictureStream, AJpegIsAPictureBesideItsCameraInfo) {
  EXPECT_EQ(camera_of_jpegs(false).overload(), "");
  Camera camera = camera_of_jpegs(true);
  EXPECT_EQ(camera.overload(), "encode 1 base\n");
  camera.finish(true);
  EXPECT_EQ(camera.status().sent_as.codec, Codec::kPictureBase);
  EXPECT_EQ(camera.status().queued, 1U);
}

TEST(PictureStream, AJpegStaysExactWhileItFits) {
  Camera camera = camera_of_jpegs(true);
  for (int i = 0; i < 100; ++i) {
    camera.publish();
    const std::string did = camera.s.did();
    ASSERT_EQ(did.find("encode"), std::string::npos) << i;
    if (did.find("compress") != std::string::npos) camera.s.finish(std::nullopt, camera.now);
    for (int part = 0; part < 5; ++part) {
      camera.now += 10;
      camera.carry(20'000);
    }
  }
  EXPECT_EQ(camera.status().messages, 100U);
  EXPECT_EQ(camera.status().sent_as.codec, Codec::kNone);
}

// A picture of a JPEG counts with more bytes than the JPEG: a peer with a limit between them would
// close the link.
TEST(PictureStream, AJpegStaysExactWhereThePeersLimitIsBelowItsPicture) {
  for (const bool fits : {false, true}) {
    Camera camera(camera_rule(), wish(), side_test::qos(10), true, std::make_shared<Account>(),
                  kJpegs);
    const auto bytes = video::picture_bytes(kJpegs.type, jpeg());
    ASSERT_GT(bytes, jpeg().size());
    camera.peer.link.connection()->set_peer_message_bytes_max(
        static_cast<std::uint32_t>(fits ? bytes : bytes - 1));
    EXPECT_EQ(camera.overload(), fits ? "encode 1 base\n" : "");
  }
}

// A peer would close the link for it.
TEST(PictureStream, ASampleOfAnotherTypeIsNoPicture) {
  Form odd = kJpegs;
  odd.sample = [](std::string_view encoding) { return image(encoding); };
  EXPECT_EQ(
      Camera(camera_rule(), wish(), side_test::qos(10), true, std::make_shared<Account>(), odd)
          .overload(),
      "");
}

TEST(PictureStream, LabelsStayExact) {
  Camera camera;
  ASSERT_EQ(camera.overload(), "encode 1 base\n");
  camera.finish(true);
  camera.carry(10'000);
  camera.publish("8UC1");
  EXPECT_EQ(camera.s.did().find("encode"), std::string::npos);
}

// The newest waits; a picture that was made is not replaced.
TEST(PictureStream, EncodesTheNewestWhenTheLastHasNearlyLeft) {
  Camera camera;
  ASSERT_EQ(camera.overload(), "encode 1 base\n");
  camera.publish();
  camera.publish();
  EXPECT_EQ(camera.s.did(), "");  // one is with the worker
  EXPECT_EQ(camera.finish(true, 4'000), "");
  EXPECT_EQ(camera.status().queued, 2U);
  camera.carry(100'000);
  camera.s.pass_to(camera.now);
  std::size_t held = kHeldPerStep;
  camera.subject.on_time(held, ms(camera.now));
  EXPECT_EQ(camera.s.did(), "encode 2\n");
  EXPECT_EQ(camera.subject.bytes(), image().size());
}

TEST(PictureStream, AfterADropTheNextRefersToNothing) {
  Camera camera;
  ASSERT_EQ(camera.overload(), "encode 1 base\n");
  camera.finish(true);
  camera.peer.link.sending().clear_channel({1}, DropReason::kQueueBytes);
  camera.publish();
  EXPECT_EQ(camera.s.did(), "encode 2 base\n");
}

// It was made from one that has not left since.
TEST(PictureStream, ADeltaOfADroppedPictureIsNotSent) {
  Camera camera;
  ASSERT_EQ(camera.overload(), "encode 1 base\n");
  camera.finish(true);
  camera.carry(100'000);
  camera.publish();
  ASSERT_EQ(camera.s.did(), "encode 2\n");
  camera.offer.send({OriginId{1}, 1, 1, Payload::adopt(Bytes(10)), {}}, Codec::kNone,
                    Payload::adopt(Bytes(10)), ms(camera.now));
  camera.peer.link.sending().clear_channel({1}, DropReason::kQueueBytes);
  camera.publish();
  EXPECT_EQ(camera.finish(false), "encode 3 base\n");
  EXPECT_EQ(camera.status().queued, 1U);
}

TEST(PictureStream, ASampleThatIsNoPictureMakesItsOriginExact) {
  Camera camera;
  ASSERT_EQ(camera.overload(), "encode 1 base\n");
  for (int i = 0; i < 2; ++i) {  // one may only be damaged
    camera.s.finish(std::nullopt, camera.now);
    camera.publish();
    EXPECT_NE(camera.s.did().find("encode"), std::string::npos);
  }
  camera.s.finish(std::nullopt, camera.now);
  for (int i = 0; i < 3; ++i) {
    camera.publish();
    EXPECT_EQ(camera.s.did().find("encode"), std::string::npos);
  }
}

TEST(PictureStream, AnEncoderCountsAsMemoryOfTheLink) {
  AccountOptions limits;
  limits.memory_bytes_max = video::encoder_bytes(image()) - 1;
  Shares shares(limits);
  const auto account = std::make_shared<Account>(limits, &shares);
  Camera camera(camera_rule(), wish(), side_test::qos(10), false, account);
  EXPECT_EQ(camera.overload(), "");
  EXPECT_GT(camera.status().dropped.of(DropReason::kMemory), 0U);
}

TEST(PictureStream, AnEndedDemandForgetsAll) {
  Camera camera;
  ASSERT_EQ(camera.overload(), "encode 1 base\n");
  camera.publish();
  camera.offer.on_demand({.channel = {1}}, ms(camera.now));
  EXPECT_EQ(camera.s.did(), "cancel 1\nend picture 1\nunsubscribe 1\n");
  EXPECT_TRUE(camera.offer.drained());
  EXPECT_EQ(camera.subject.bytes(), 0U);
}

TEST(PictureStream, ExactAgainWhereTheyFitForSomeSeconds) {
  Camera camera;
  ASSERT_EQ(camera.overload(), "encode 1 base\n");
  bool exact = false;
  for (int i = 0; i < 400 && !exact; ++i) {
    camera.s.finish(Payload::adopt(body_of(image(), i == 0, 10'000)), camera.now);
    camera.now += 1;
    camera.carry(1'000'000);
    camera.now += 49;
    camera.publish();
    exact = camera.s.did().find("encode") == std::string::npos;
  }
  EXPECT_TRUE(exact);
  EXPECT_GT(camera.now, 5'000);
}

// ---- packets of a video that somebody else has encoded

Bytes h264(std::string_view kind) {
  Bytes data{0, 0, 0, 1, static_cast<std::uint8_t>(kind == "key" ? 0x65 : 0x41)};
  data.resize(4'000);
  return media::compressed_sample(data, "h264");
}

// The type alone would make a newer packet replace an older one.
TEST(VideoPackets, AfterALossLeaveFromTheNextKeyFrameOn) {
  const Form packets{"/camera/raw/compressed", "sensor_msgs/msg/CompressedImage", h264, ""};
  Rule rule = everything();
  rule.treatment.keep = Keep::kNewest;
  Camera camera(rule, wish(), side_test::qos(10), false, std::make_shared<Account>(), packets);
  const auto cross = [&](std::initializer_list<const char*> kinds) {
    for (const char* kind : kinds) camera.publish(kind);
    for (int i = 0; i < 10; ++i) camera.carry(1'000'000);
  };
  cross({"key", "delta", "delta"});
  ++camera.number;  // the middleware has lost one
  cross({"delta", "delta"});
  cross({"key", "delta"});
  EXPECT_EQ(camera.status().messages, 5U);
  EXPECT_EQ(camera.status().dropped.of(DropReason::kGroup), 2U);
  EXPECT_EQ(camera.status().queued, 0U);
}

// The newest of those that a rate refuses waits, but not one that nobody can decode any more.
TEST(VideoPackets, ARateCutsGroups) {
  const Form packets{"/camera/raw/compressed", "sensor_msgs/msg/CompressedImage", h264, ""};
  Rule slow = everything();
  slow.treatment.max_rate = 10;
  Camera camera(slow, wish(), side_test::qos(10), false, std::make_shared<Account>(), packets);
  for (int i = 0; i < 90; ++i) {
    camera.now = 100 + 100 * i / 3;
    camera.publish(i % 30 == 0 ? "key" : "delta");
    camera.carry(1'000'000);
  }
  camera.s.pass_to(camera.now + 10'000);
  std::size_t held = kHeldPerStep;
  camera.subject.on_time(held, ms(camera.now + 10'000));
  const TopicStatus status = camera.status();
  EXPECT_GE(status.messages, 20U);
  EXPECT_LE(status.messages, 42U);
  EXPECT_EQ(status.dropped.of(DropReason::kRate), 90 - status.messages);  // none as kGroup
  EXPECT_EQ(status.queued, 0U);
}

// ---- the importer

struct ReceivingPictures : OfferedScript {
  explicit ReceivingPictures(const Rule& rule = camera_rule()) {
    options.pictures = true;
    policy = Policy({rule});
    Topic state = topic("/a").sub(50);
    state.type = kPicture;
    graph = picture({state});
    one.link.expect_offered({1}, InterfaceKind::kTopic);
    ChannelOffer offered = channel(1, "/a", {origin(1, 7), origin(2, 8)});
    offered.type = kPicture;
    peer.on_offer(offered, ms(0));
    peer.send_demands();
    did();
  }
  Result<Nothing> give(bool base, std::uint32_t from = 1, bool kept = true, std::int64_t at = 0) {
    const Bytes raw = image();
    InMessage result = message("", 1);
    result.subject = OriginId{from};
    result.codec = base ? Codec::kPictureBase : Codec::kPictureDelta;
    result.raw_bytes = static_cast<std::uint32_t>(raw.size());
    result.body = Payload::adopt(body_of(raw, base, 100));
    result.kept = kept;
    return channel_1().on_message(std::move(result), ms(at));
  }
  std::uint64_t dropped() const {
    LinkStatus status;
    peer.add_status(status);
    return status.topics.at(0).dropped.total();
  }
};

TEST(VideoPackets, TheImportersRateCutsGroups) {
  Rule slow = everything();
  slow.treatment.max_rate = 10;
  OfferedScript s;
  s.policy = Policy({slow});
  Topic state = topic("/a").sub(50);
  state.type = kJpegs.type;
  s.graph = picture({state});
  s.one.link.expect_offered({1}, InterfaceKind::kTopic);
  ChannelOffer offered = channel(1, "/a", {origin(1, 7)});
  offered.type = kJpegs.type;
  s.peer.on_offer(offered, ms(0));
  s.peer.send_demands();
  std::uint64_t published = 0;
  bool before = false;
  for (int i = 0; i < 90; ++i) {
    const bool is_key = i % 30 == 0;
    InMessage packet = s.message("", 1);
    packet.body = Payload::adopt(h264(is_key ? "key" : "delta"));
    packet.raw_bytes = static_cast<std::uint32_t>(packet.body.size());
    s.give(std::move(packet), 100 * i / 3);
    LinkStatus status;
    s.peer.add_status(status);
    const bool passes = std::exchange(published, status.topics.at(0).messages) < published;
    EXPECT_TRUE(is_key || before || !passes) << i;
    before = passes;
  }
  s.pass_to(20'000);
  EXPECT_GE(published, 20U);
  EXPECT_EQ(s.dropped(DropReason::kRate), 90 - published);
}

TEST(Pictures, AreDecodedInOrderAndPublished) {
  ReceivingPictures s;
  ASSERT_TRUE(s.give(true));
  ASSERT_TRUE(s.give(false));
  EXPECT_EQ(s.did(), "decode 1\n");
  s.finish(Payload::adopt(image()));
  EXPECT_NE(s.did().find("decode 2\n"), std::string::npos);
  LinkStatus status;
  s.peer.add_status(status);
  EXPECT_EQ(status.topics.at(0).sent_as.codec, Codec::kPictureBase);
  EXPECT_NE(s.logged.find("as video"), std::string::npos);
}

// Whoever subscribes to one type would get a message of the other.
TEST(Pictures, OneOfAnotherTypeEndsTheLink) {
  ReceivingPictures s;
  const Bytes body = body_of(jpeg(), true, 100);
  InMessage odd = s.message("", 1);
  odd.codec = Codec::kPictureBase;
  odd.raw_bytes = static_cast<std::uint32_t>(video::facts_of(body)->raw_bytes);
  odd.body = Payload::adopt(Bytes(body));
  const auto refused = s.channel_1().on_message(std::move(odd), ms(0));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, CloseCode::kMalformed);
}

TEST(Pictures, ADamagedOneEndsTheLink) {
  ReceivingPictures s;
  InMessage damaged = s.message("", 1);
  damaged.codec = Codec::kPictureBase;
  damaged.raw_bytes = 40'000;
  damaged.body = Payload::adopt(Bytes(100));
  const auto refused = s.channel_1().on_message(std::move(damaged), ms(0));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, CloseCode::kMalformed);
}

TEST(Pictures, WhatNobodyAllowedEndsTheLink) {
  Rule never = camera_rule();
  never.treatment.lossy = Lossy::kNever;
  ReceivingPictures s(never);
  const auto refused = s.give(true);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, CloseCode::kMalformed);
}

TEST(Pictures, WaitForTheirWorkerWhateverTheDepth) {
  ReceivingPictures s;
  ASSERT_TRUE(s.give(true));
  for (int i = 0; i < 150; ++i) ASSERT_TRUE(s.give(false));
  EXPECT_EQ(s.dropped(), 0U);
}

// Those that refer to a dropped one are dropped, and a new demand brings one that does not.
TEST(Pictures, ADroppedOneMakesANewDemand) {
  ReceivingPictures s;
  EXPECT_EQ(s.one.said(), "demand 1 on\n");
  ASSERT_TRUE(s.give(true));
  ASSERT_TRUE(s.give(false, 1, false));
  s.peer.send_demands();
  EXPECT_EQ(s.one.said(), "demand 1 off\n");
  EXPECT_GE(s.dropped(), 1U);
  s.pass_to(10'000);
  s.peer.send_demands();
  EXPECT_EQ(s.one.said(), "demand 1 on\n");
}

TEST(Pictures, OfAnOriginThatIsNotHereAreDropped) {
  ReceivingPictures s;
  ASSERT_TRUE(s.give(true, 9));
  ASSERT_TRUE(s.give(true));
  ASSERT_TRUE(s.channel_1().on_origins({{1}, {}, {{1}}}, ms(0)));
  ASSERT_TRUE(s.give(false));
  EXPECT_EQ(s.did(), "decode 1\ncancel 1\nend picture 1\n");
  EXPECT_EQ(s.dropped(), 3U);
}

// A delta whose base did not come here is no fault of the peer's.
TEST(Pictures, ADeltaWithoutItsBaseMakesANewDemand) {
  ReceivingPictures s;
  EXPECT_EQ(s.one.said(), "demand 1 on\n");
  ASSERT_TRUE(s.give(false));
  s.peer.send_demands();
  EXPECT_EQ(s.one.said(), "demand 1 off\n");
}

TEST(Pictures, DoNotWaitForASlowWorkerForEver) {
  ReceivingPictures s;
  ASSERT_TRUE(s.give(true));
  ASSERT_TRUE(s.give(false, 1, true, 400));
  EXPECT_EQ(s.dropped(), 0U);
  ASSERT_TRUE(s.give(false, 1, true, 600));
  EXPECT_GE(s.dropped(), 1U);
}

TEST(Pictures, AnEndedDemandForgetsThem) {
  ReceivingPictures s;
  ASSERT_TRUE(s.give(true));
  s.did();
  ASSERT_TRUE(s.give(false, 2, false));
  s.peer.send_demands();
  EXPECT_EQ(s.did(), "cancel 1\nend picture 1\n");
}

}  // namespace
}  // namespace connect_bridge::topics_test
