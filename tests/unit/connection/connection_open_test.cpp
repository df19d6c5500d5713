// A connection in state open: frames, liveness, acknowledgements, clocks.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "unit/link/script.hpp"

namespace connect_bridge::link_test {
namespace {

TEST(ConnectionOpen, MessagesOfExpectedChannelsArrive) {
  auto script = open_client();
  script.expect(1);
  EXPECT_EQ(script.binary(message(1, 1, 5) + message(1, 4, 0)), "message 1#1:5, message 1#4:0");
  EXPECT_EQ(script.binary(message(1, 5, 10, 4)), "-");
  EXPECT_EQ(script.link.open_bytes(), 10U);
  EXPECT_EQ(script.binary(part(1, 2) + part(1, 4)), "message 1#5:10");
  EXPECT_EQ(script.link.open_bytes(), 0U);
}

TEST(ConnectionOpen, DataForUnknownChannelsEndsTheLink) {
  EXPECT_EQ(open_client().binary(message(1, 1, 5)), "failed 4010");
  EXPECT_EQ(open_client().binary(part(1, 5)), "failed 4010");
  EXPECT_EQ(open_client().binary(abort_of(1)), "failed 4010");
}

TEST(ConnectionOpen, DataForAForgottenChannelEndsTheLink) {
  auto script = open_client();
  script.expect(1);
  EXPECT_EQ(script.binary(message(1, 1, 10, 4)), "-");
  script.forget(1);
  EXPECT_EQ(script.link.open_bytes(), 0U);
  EXPECT_EQ(script.binary(part(1, 6)), "failed 4010");
}

TEST(ConnectionOpen, AChannelMayEndWithItsMessage) {
  auto script = open_client();
  script.expect_one(1);
  EXPECT_EQ(script.binary(message(1, 1, 10, 4)), "-");
  EXPECT_EQ(script.binary(part(1, 6) + message(1, 2, 5)), "message 1#1:10, failed 4010");
  EXPECT_EQ(script.link.open_bytes(), 0U);
}

// The peer does not know it yet: its frames are checked, and take no memory.
TEST(ConnectionOpen, WhatComesOnAChannelThatHasEndedHereIsDropped) {
  auto script = open_client();
  script.expect(1);
  EXPECT_EQ(script.binary(message(1, 1, 10, 4)), "-");
  script.let_go(1);
  EXPECT_EQ(script.binary(part(1, 6) + message(1, 2, 5)), "-");
  EXPECT_EQ(script.binary(message(1, 3, 10, 4)), "-");
  EXPECT_EQ(script.link.open_bytes(), 0U);
  EXPECT_EQ(script.binary(part(1, 6) + part(1, 1)), "failed 4009");
}

// All frames of a packet are one turn of the loop.
TEST(ConnectionOpen, APacketOfTooManyFramesEndsTheLink) {
  auto script = open_client();
  script.expect(1);
  Bytes most;
  for (std::uint32_t frame = 1; frame <= kPacketFramesMax; ++frame)
    most = std::move(most) + message(1, frame, 0);
  EXPECT_EQ(script.binary(most).find("failed"), std::string::npos);
  Bytes more;
  for (std::uint32_t frame = 1; frame <= kPacketFramesMax + 1; ++frame)
    more = std::move(more) + message(1, kPacketFramesMax + frame, 0);
  EXPECT_TRUE(script.binary(more).ends_with("failed 4006"));
}

TEST(ConnectionOpen, WhatStandsBeforeAWrongFrameIsActedUpon) {
  auto script = open_client();
  script.expect(1);
  EXPECT_EQ(script.binary(message(1, 1, 5) + message(2, 1, 5) + message(1, 2, 5)),
            "message 1#1:5, failed 4010");
}

// docs/protocol.md section 6, "refused with".
TEST(ConnectionOpen, WrongDataHasItsCode) {
  const struct {
    const char* what;
    Bytes packet;
    const char* code;
  } rows[] = {
      {"a part without a message", part(1, 5), "4009"},
      {"an abort without a message", abort_of(1), "4009"},
      {"a message in a message", message(1, 1, 9, 4) + message(1, 2, 9), "4009"},
      {"a sequence that does not rise", message(1, 7, 0) + message(1, 7, 0), "4009"},
      {"a part that is too long", message(1, 1, 9, 4) + part(1, 6), "4002"},
      {"a message that is too large", message(1, 1, 101), "4006"},
      {"too many open bytes", message(1, 1, 90, 1) + message(2, 1, 61, 1), "4006"},
      {"an unknown frame", Bytes(16, 6), "4002"},
      {"half a frame", Bytes{3, 0, 0, 0}, "4002"},
  };
  for (const auto& row : rows) {
    SCOPED_TRACE(row.what);
    auto small = options(true);
    small.reassembly = {100, 150};
    Script script(small);
    script.binary(hello());
    script.binary(login());
    script.authenticated();
    script.expect(1);
    script.expect(2);
    EXPECT_THAT(script.binary(row.packet), testing::EndsWith(std::string("failed ") + row.code));
  }
}

TEST(ConnectionOpen, AnAckOfMoreThanWasSentEndsTheLink) {
  EXPECT_EQ(open_client().binary(bytes_of(AckFrame{0})), "-");
  EXPECT_EQ(open_client().binary(bytes_of(AckFrame{1})), "failed 4009");
}

TEST(ConnectionOpen, OnlyBinaryPacketsOfStateOpenCount) {
  auto script = open_client();
  EXPECT_EQ(script.link.received_bytes(), 0U);  // not the welcome
  EXPECT_EQ(script.text(R"({"type":"demand","channels":[{"channel":1,"number":1}]})"), "control");
  EXPECT_EQ(script.link.received_bytes(), 0U);
  script.expect(1);
  script.binary(message(1, 1, 56));
  EXPECT_EQ(script.link.received_bytes(), 100U);
  EXPECT_EQ(script.pass(99), "-");
  EXPECT_EQ(script.sent(), "ask\n");  // the sign of life; the next one is due with the ack
  EXPECT_EQ(script.pass(100), "-");
  EXPECT_EQ(script.sent(), "ack 100 ask\n");
  EXPECT_EQ(script.link.sent_bytes(), 56U);
}

TEST(ConnectionOpen, WhatAsksIsAcknowledgedAtOnce) {
  auto script = open_client();
  script.expect(1);
  script.binary(message(1, 1, 56) + bytes_of(AckRequest{}));
  EXPECT_EQ(script.sent(), "ack 108\n");
}

TEST(ConnectionOpen, TimeRequestsAreAnsweredAtOnce) {
  auto script = open_server();
  script.at = 50;
  EXPECT_EQ(script.binary(bytes_of(TimeRequest{4711})), "-");
  const auto packet = script.link.next_packet(now_ms(50));
  ASSERT_TRUE(packet);
  const auto bytes = joined(*packet);
  const auto frame = FrameReader(bytes).next();
  const auto& reply = std::get<TimeReply>(*frame.value());
  EXPECT_EQ(reply.t1, 4711);
  EXPECT_EQ(reply.t2, now_ms(50).system);
  EXPECT_EQ(reply.t3, now_ms(50).system);
  EXPECT_EQ(reply.ros, 0);
}

TEST(ConnectionOpen, RepliesToOwnRequestsTellTheClock) {
  auto script = open_server();
  EXPECT_EQ(script.pass(0), "-");
  EXPECT_EQ(script.sent(), "ask\n");
  script.at = 40;
  const Stamp there = now_ms(5020).system;
  EXPECT_EQ(script.binary(bytes_of(TimeReply{now_ms(0).system, there, there, 0})), "clock");
  EXPECT_TRUE(script.link.clock().known());
  EXPECT_EQ(script.link.clock().offset(), std::chrono::milliseconds(5000));
  EXPECT_EQ(script.link.clock().round_trip(), std::chrono::milliseconds(40));
  // The same once more: it is not asked for any longer.
  EXPECT_EQ(script.binary(bytes_of(TimeReply{now_ms(0).system, there, there, 0})), "-");
}

TEST(ConnectionOpen, TimeRepliesNotAskedForAreIgnored) {
  auto script = open_server();
  EXPECT_EQ(script.pass(0), "-");
  script.at = 10;
  const Stamp there = now_ms(9999).system;
  EXPECT_EQ(script.binary(bytes_of(TimeReply{now_ms(1).system, there, there, 77})), "-");
  EXPECT_FALSE(script.link.clock().known());
}

TEST(ConnectionOpen, TheFirstTimeRequestsAreQuickThenEveryThirdOfDeadAfter) {
  auto script = open_server();
  std::vector<std::int64_t> asked;
  for (std::int64_t t = 0; t <= 4000; t += 10) {
    script.binary({});  // the peer lives
    script.pass(t);
    if (script.sent() == "ask\n") asked.push_back(t);
  }
  EXPECT_EQ(asked, (std::vector<std::int64_t>{0, 100, 200, 300, 400, 500, 1500, 2500, 3500}));
}

TEST(ConnectionOpen, ASilentPeerIsDead) {
  auto script = open_server();
  EXPECT_EQ(script.pass(2000), "-");
  EXPECT_EQ(script.binary({}), "-");  // any WebSocket message proves life
  EXPECT_EQ(script.pass(4999), "-");
  EXPECT_EQ(script.pass(5000), "failed 4008");
}

TEST(ConnectionOpen, AfterAChangeOfTheNetworkAPeerIsHeardSoonOrGone) {
  auto script = open_server();
  script.pass(1700);
  script.sent();
  script.link.probe(now_ms(1700));
  EXPECT_EQ(script.pass(1700), "-");
  EXPECT_EQ(script.sent(), "ask\n");
  EXPECT_EQ(script.pass(2600), "-");
  EXPECT_EQ(script.binary({}), "-");
  EXPECT_EQ(script.pass(5599), "-");  // as usual
}

TEST(ConnectionOpen, WhoIsSilentAfterAChangeOfTheNetworkIsGone) {
  auto script = open_server();
  script.link.probe(now_ms(0));
  EXPECT_EQ(script.pass(900), "-");
  script.link.probe(now_ms(900));  // another change gives no more time
  EXPECT_EQ(script.pass(999), "-");
  EXPECT_EQ(script.pass(1000), "failed 4008");
}

TEST(ConnectionOpen, ControlTextsThatBackUpEndTheLink) {
  auto tight = options(false);
  tight.outbox.control_bytes_max = 10;
  Script script(tight);
  EXPECT_EQ(script.binary(encode(a_welcome())), "open");
  EXPECT_EQ(script.send("12345"), "-");
  EXPECT_EQ(script.send("12345"), "-");
  EXPECT_EQ(script.send("6"), "failed 4007");
}

TEST(ConnectionOpen, NothingIsSentBeforeTheLoginIsThrough) {
  Script script(false);
  EXPECT_EQ(script.send("{}"), "-");
  script.link.next_packet(now_ms(0));
  script.link.next_packet(now_ms(0));
  EXPECT_EQ(script.sent(), "");
}

TEST(ConnectionOpen, AcknowledgedTrackedMessagesAreReported) {
  auto script = open_server();
  script.link.outbox().add_channel({3}, {});
  auto tracked = flow_test::message(10);
  tracked.tracked = true;
  script.link.outbox().push({3}, std::move(tracked), now_ms(0));
  EXPECT_EQ(script.sent(), "3#1:10\n");
  EXPECT_EQ(script.binary(bytes_of(AckFrame{53})), "-");
  EXPECT_EQ(script.binary(bytes_of(AckFrame{54})), "delivered 3.7");
}

}  // namespace
}  // namespace connect_bridge::link_test
