// The frames that overtake all data.
#include "core/flow/small_frames.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "unit/flow/script.hpp"

namespace connect_bridge::flow_test {
namespace {

// What leaves in the next packet.
struct SmallPacket {
  std::vector<std::uint64_t> acks;
  std::vector<Stamp> asked;           // by time requests
  std::vector<std::uint32_t> aborts;  // channels
};

SmallPacket leave(SmallFrames& frames) {
  PacketBuilder builder;
  frames.leave(builder);
  const Bytes bytes = joined(builder.finish());
  SmallPacket left;
  FrameReader reader(bytes);
  for (auto frame = reader.next(); frame && frame.value(); frame = reader.next()) {
    if (const auto* ack = std::get_if<AckFrame>(&*frame.value()))
      left.acks.push_back(ack->received_bytes);
    if (const auto* time = std::get_if<TimeRequest>(&*frame.value()))
      left.asked.push_back(time->t1);
    if (const auto* part = std::get_if<PartFrame>(&*frame.value()); part && part->abort)
      left.aborts.push_back(part->channel.value);
  }
  return left;
}

AckFrame ack_of(std::uint64_t bytes) {
  AckFrame ack;
  ack.received_bytes = bytes;
  return ack;
}

TEST(SmallFrames, ANewerAcknowledgementSaysAll) {
  SmallFrames frames;
  EXPECT_FALSE(frames.waits());
  frames.push(ack_of(1));
  frames.push(ack_of(2));
  EXPECT_TRUE(frames.waits());
  EXPECT_EQ(leave(frames).acks, std::vector<std::uint64_t>{2});
  EXPECT_FALSE(frames.waits());
  EXPECT_TRUE(leave(frames).acks.empty());  // once
}

// A peer may ask faster than it reads.
TEST(SmallFrames, OfTimeFramesTheNewestWait) {
  SmallFrames frames;
  for (std::size_t i = 0; i < kTimeFramesMax + 2; ++i)
    frames.push(TimeRequest{static_cast<Stamp>(i)});
  EXPECT_TRUE(frames.waits());
  const auto left = leave(frames);
  ASSERT_EQ(left.asked.size(), kTimeFramesMax);
  EXPECT_EQ(left.asked.front(), 2);
  EXPECT_EQ(left.asked.back(), static_cast<Stamp>(kTimeFramesMax + 1));
  EXPECT_FALSE(frames.waits());
}

// The packet of a side that ends all its channels at once is legal for the peer.
TEST(SmallFrames, APacketHasSoManyAbortsAndTheRestFollows) {
  SmallFrames frames;
  for (std::uint32_t n = 1; n <= kPacketAbortsMax + 1; ++n) frames.abort({n});
  EXPECT_FALSE(frames.waits());
  EXPECT_TRUE(frames.aborts_wait());
  EXPECT_EQ(leave(frames).aborts.size(), kPacketAbortsMax);
  EXPECT_TRUE(frames.aborts_wait());
  EXPECT_EQ(leave(frames).aborts, std::vector<std::uint32_t>{kPacketAbortsMax + 1});
  EXPECT_FALSE(frames.aborts_wait());
}

// The peer would not know the channel any more.
TEST(SmallFrames, OfAChannelThatHasEndedNothingIsAborted) {
  SmallFrames frames;
  for (const std::uint32_t n : {1U, 2U, 1U, 3U}) frames.abort({n});
  frames.forget({1});
  EXPECT_EQ(leave(frames).aborts, (std::vector<std::uint32_t>{2, 3}));
}

}  // namespace
}  // namespace connect_bridge::flow_test
