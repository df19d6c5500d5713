// Which of the messages that were sent have arrived, as the peer acknowledges bytes.
#include "core/flow/in_flight.hpp"

#include <gtest/gtest.h>

#include <string>

namespace connect_bridge {
namespace {

struct Flying {
  void add(std::uint32_t channel) { subject.add({{channel}, {}}); }
  // The channels of those that have arrived, given that the peer has so many bytes.
  std::string arrived(std::uint64_t bytes) {
    std::string words;
    while (const auto message = subject.take_arrived(bytes))
      words += (words.empty() ? "" : " ") + std::to_string(message->channel.value);
    return words;
  }

  InFlight subject;
};

TEST(InFlight, AMessageHasArrivedWithThePacketOfItsLastPart) {
  Flying s;
  s.add(1);
  s.add(2);
  s.subject.packet_ends(100);
  s.add(3);
  s.subject.packet_ends(150);
  EXPECT_EQ(s.arrived(99), "");
  EXPECT_EQ(s.arrived(100), "1 2");
  EXPECT_EQ(s.arrived(149), "");
  EXPECT_EQ(s.arrived(150), "3");
  EXPECT_EQ(s.arrived(1000), "");  // once
}

// An acknowledgement may come while a packet is gathered.
TEST(InFlight, WhatIsInNoPacketYetHasNotArrived) {
  Flying s;
  s.add(1);
  EXPECT_EQ(s.arrived(1'000'000), "");
  s.subject.packet_ends(100);
  s.add(2);
  EXPECT_EQ(s.arrived(1'000'000), "1");
  s.subject.packet_ends(200);
  EXPECT_EQ(s.arrived(199), "");
  EXPECT_EQ(s.arrived(200), "2");
}

TEST(InFlight, APacketWithoutTheEndOfAMessageChangesNothing) {
  Flying s;
  s.add(1);
  s.subject.packet_ends(100);
  s.subject.packet_ends(500);
  EXPECT_EQ(s.arrived(100), "1");
}

}  // namespace
}  // namespace connect_bridge
