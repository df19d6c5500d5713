// Words for tests of the flow: short messages, a clock, and packets as one line of text.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <string>

#include "core/flow/outbox.hpp"

namespace connect_bridge::flow_test {

inline constexpr ChannelId kA{1};
inline constexpr ChannelId kB{2};
inline constexpr ChannelId kC{3};
inline constexpr ChannelId kD{4};

// Milliseconds after an arbitrary start of the system clock.
inline constexpr Stamp kStart = 1'700'000'000'000'000'000;
Stamp at_ms(std::int64_t ms);
Now now_ms(std::int64_t ms);

OutMessage message(std::size_t size, Stamp stamp = 0);
QueueOptions queue(Priority priority);
// Parts of 100 bytes, each in a packet of its own, so that order is easy to read. Nothing is paced
// and no ack is asked for.
OutboxOptions one_by_one();

Bytes joined(const Packet& packet);
// "1#5:100" is message 5 of channel 1, whole, 100 bytes; "1#5:64/100" its first 64 bytes; "1+36" a
// part of 36 bytes; "1!" an abort; "ack 9", "ask", "answer"; a control text stands in quotes.
std::string line_of(const Packet& packet);
// The next packet as a line, "-" when there is none.
std::string next(Outbox& outbox, const Now& now = now_ms(0));
// All packets, one line each.
std::string drain(Outbox& outbox, const Now& now = now_ms(0));

void expect_balance(const ChannelCounts& counts);
std::uint64_t dropped(const Outbox& outbox, ChannelId channel, DropReason reason);

}  // namespace connect_bridge::flow_test
