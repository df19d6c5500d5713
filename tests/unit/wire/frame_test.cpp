#include "core/wire/frame.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "unit/wire/vectors.hpp"

// Layouts and malformed frames are in tests/vectors; here is what vectors cannot say.
namespace connect_bridge {
namespace {

Bytes header_of(const Frame& frame) {
  Bytes out;
  append_header(frame, out);
  return out;
}

TEST(Frame, HeadersHaveTheSizesThatSendersReserve) {
  EXPECT_EQ(header_of(MessageFrame{}).size(), kMessageHeaderBytes);
  EXPECT_EQ(header_of(PartFrame{}).size(), kPartHeaderBytes);
  EXPECT_EQ(header_of(AckFrame{}).size(), kAckBytes);
  EXPECT_EQ(header_of(TimeRequest{}).size(), kTimeRequestBytes);
  EXPECT_EQ(header_of(TimeReply{}).size(), kTimeReplyBytes);
}

TEST(Frame, HeaderIsAppendedAndPartIsLeftWhereItLies) {
  const Bytes body{1, 2, 3};
  Bytes out{9};
  MessageFrame frame;
  frame.part = body;
  append_header(frame, out);
  EXPECT_EQ(out.size(), 1 + kMessageHeaderBytes);
  EXPECT_EQ(out[0], 9);
  EXPECT_EQ(out[1 + 40], 3);  // part_bytes
}

TEST(Frame, PartsReferToThePacket) {
  const Bytes packet = from_hex("02 00 0000 07000000 02000000 aabb");
  FrameReader reader{packet};
  const auto frame = reader.next();
  ASSERT_TRUE(frame.ok());
  ASSERT_TRUE(frame.value().has_value());
  EXPECT_EQ(std::get<PartFrame>(*frame.value()).part.data(), packet.data() + kPartHeaderBytes);
}

TEST(Frame, FramesBeforeAnErrorAreReadAndTheErrorStays) {
  Bytes packet = header_of(AckFrame{77});
  packet.push_back(0);
  FrameReader reader{packet};

  const auto ack = reader.next();
  ASSERT_TRUE(ack.ok());
  EXPECT_EQ(std::get<AckFrame>(*ack.value()).received_bytes, 77U);
  EXPECT_FALSE(reader.next().ok());
  EXPECT_FALSE(reader.next().ok());
}

TEST(Frame, ACompressedBodyIsNotMuchLargerThanItsSample) {
  const Bytes body(133);
  for (const std::uint32_t size : {132, 133}) {
    MessageFrame frame;
    frame.channel = {1};
    frame.subject = OriginId{1};
    frame.sequence = 1;
    frame.codec = Codec::kZstd;
    frame.raw_bytes = 4;
    frame.body_bytes = size;
    frame.part = ByteView{body}.first(size);
    Bytes packet = header_of(frame);
    packet.insert(packet.end(), frame.part.begin(), frame.part.end());
    EXPECT_EQ(FrameReader{packet}.next().ok(), size == 132) << size;
  }
}

TEST(Frame, EndOfPacketStays) {
  FrameReader reader{ByteView{}};
  EXPECT_FALSE(reader.next().value().has_value());
  EXPECT_FALSE(reader.next().value().has_value());
}

TEST(Frame, EveryProperPrefixOfAFrameIsRefused) {
  Bytes message = header_of(
      MessageFrame{{.subject = {1}, .sequence = 1, .stamp = 1, .raw_bytes = 5}, {1}, 5, {}});
  message[40] = 5;  // part_bytes
  message.insert(message.end(), {1, 2, 3, 4, 5});
  for (const Bytes& whole : {message, header_of(AckFrame{1}), header_of(TimeRequest{1}),
                             header_of(TimeReply{1, 2, 3, 4})}) {
    EXPECT_TRUE(FrameReader{whole}.next().ok());
    for (std::size_t size = 1; size < whole.size(); ++size) {
      const auto frame = FrameReader{ByteView{whole}.first(size)}.next();
      ASSERT_FALSE(frame.ok()) << size << " bytes";
      EXPECT_EQ(frame.error().code, CloseCode::kMalformed);
    }
  }
}

TEST(Frame, StampsThatNoClockShowsLeaveAsNotKnown) {
  constexpr Stamp kSmallest = std::numeric_limits<Stamp>::min();
  constexpr Stamp kLargest = std::numeric_limits<Stamp>::max();
  const Bytes bytes = header_of(TimeReply{-1, kSmallest, kLargest, kWireStampMax});
  const auto frame = FrameReader{bytes}.next();
  ASSERT_TRUE(frame.ok());
  const auto& reply = std::get<TimeReply>(*frame.value());
  EXPECT_EQ(reply.t1, 0);
  EXPECT_EQ(reply.t2, 0);
  EXPECT_EQ(reply.t3, 0);
  EXPECT_EQ(reply.ros, kWireStampMax);
}

}  // namespace
}  // namespace connect_bridge
