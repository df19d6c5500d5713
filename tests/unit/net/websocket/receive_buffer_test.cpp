#include "net/websocket/receive_buffer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

namespace connect_bridge {
namespace {

void receive(ReceiveBuffer& buffer, const std::string& text) {
  const auto room = buffer.prepare(text.size());
  ASSERT_EQ(room.size(), text.size());
  std::copy(text.begin(), text.end(), static_cast<char*>(static_cast<void*>(room.data())));
  buffer.commit(text.size());
}

std::string text_in(const Payload& payload) {
  return {payload.view().begin(), payload.view().end()};
}

TEST(ReceiveBuffer, WhatIsReceivedInPiecesIsOnePayload) {
  ReceiveBuffer buffer;
  std::string all;
  for (int i = 0; i < 300; ++i) {
    const std::string piece(static_cast<std::size_t>(i), static_cast<char>('a' + i % 26));
    receive(buffer, piece);
    all += piece;
  }
  EXPECT_EQ(buffer.size(), all.size());
  EXPECT_EQ(text_in(buffer.take()), all);
  EXPECT_EQ(buffer.size(), 0U);
  EXPECT_EQ(text_in(buffer.take()), "");
}

TEST(ReceiveBuffer, ALargePacketIsHandedOverAndNotCopied) {
  ReceiveBuffer buffer;
  receive(buffer, std::string(100'000, 'x'));
  const void* const bytes = buffer.data().data();
  const Payload packet = buffer.take();
  EXPECT_EQ(packet.view().data(), bytes);
  EXPECT_EQ(buffer.capacity(), 0U);
  receive(buffer, std::string(100'000, 'y'));
  EXPECT_EQ(text_in(packet), std::string(100'000, 'x'));
}

// Who keeps it would keep all of the buffer.
TEST(ReceiveBuffer, ASmallPacketIsCopiedAndTheBufferIsUsedAgain) {
  ReceiveBuffer buffer;
  receive(buffer, "small");
  const std::size_t capacity = buffer.capacity();
  const void* const bytes = buffer.data().data();
  const Payload packet = buffer.take();
  EXPECT_NE(packet.view().data(), bytes);
  EXPECT_EQ(buffer.capacity(), capacity);
  receive(buffer, "other");
  EXPECT_EQ(text_in(packet), "small");
  EXPECT_EQ(text_in(buffer.take()), "other");
}

TEST(ReceiveBuffer, APacketOfManyFramesGrowsByHalf) {
  ReceiveBuffer buffer;
  std::size_t growths = 0;
  for (std::size_t before = 0, i = 0; i < 10'000; ++i) {
    receive(buffer, std::string(100, 'x'));
    growths += buffer.capacity() != before;
    before = buffer.capacity();
  }
  EXPECT_EQ(buffer.size(), 1'000'000U);
  EXPECT_LE(growths, 17U);
  EXPECT_LE(buffer.capacity(), 1'500'000U);
}

TEST(ReceiveBuffer, WhatIsConsumedIsTakenFromTheFront) {
  ReceiveBuffer buffer;
  receive(buffer, "onetwo");
  buffer.consume(3);
  EXPECT_EQ(text_in(buffer.take()), "two");
  receive(buffer, "three");
  buffer.consume(9);
  EXPECT_EQ(buffer.size(), 0U);
  buffer.commit(100'000);  // no more than was prepared
  EXPECT_EQ(buffer.size(), buffer.capacity());
}

}  // namespace
}  // namespace connect_bridge
