// Words for tests of the flow: short messages, a clock, and packets as one line of text.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <string>
#include <variant>

#include "core/flow/outbox.hpp"

namespace connect_bridge::flow_test {

inline constexpr ChannelId kA{1};
inline constexpr ChannelId kB{2};
inline constexpr ChannelId kC{3};
inline constexpr ChannelId kD{4};

// Milliseconds after an arbitrary start of the system clock.
inline constexpr Stamp kStart = 1'700'000'000'000'000'000;
inline Stamp at_ms(std::int64_t ms) {
  return kStart + ms * 1'000'000;
}
inline Now now_ms(std::int64_t ms) {
  return Now{TimePoint{std::chrono::milliseconds(ms)}, at_ms(ms), 0};
}

inline OutMessage message(std::size_t size, Stamp stamp = 0) {
  OutMessage result;
  result.subject = OriginId{7};
  result.stamp = stamp;
  result.body = Payload::adopt(Bytes(size, static_cast<std::uint8_t>(size)));
  return result;
}

inline QueueOptions queue(Priority priority) {
  QueueOptions options;
  options.priority = priority;
  return options;
}

inline Bytes joined(const Packet& packet) {
  Bytes bytes;
  for (const auto& piece : packet.pieces) {
    bytes.insert(bytes.end(), piece.view().begin(), piece.view().end());
  }
  return bytes;
}

// "1#5:100" is message 5 of channel 1, whole, 100 bytes; "1#5:64/100" its first 64 bytes; "1+36" a
// part of 36 bytes; "1!" an abort; "ack 9", "ask", "answer"; a control text stands in quotes.
inline std::string word_of(const Frame& frame) {
  if (const auto* first = std::get_if<MessageFrame>(&frame)) {
    auto word = std::to_string(first->channel.value) + "#" + std::to_string(first->sequence) + ":" +
                std::to_string(first->part.size());
    if (first->part.size() < first->body_bytes) word += "/" + std::to_string(first->body_bytes);
    return word;
  }
  if (const auto* part = std::get_if<PartFrame>(&frame)) {
    const auto channel = std::to_string(part->channel.value);
    return part->abort ? channel + "!" : channel + "+" + std::to_string(part->part.size());
  }
  if (const auto* ack = std::get_if<AckFrame>(&frame)) {
    return "ack " + std::to_string(ack->received_bytes);
  }
  return std::holds_alternative<TimeRequest>(frame) ? "ask" : "answer";
}

inline std::string line_of(const Packet& packet) {
  const auto bytes = joined(packet);
  if (packet.text) return '"' + std::string(bytes.begin(), bytes.end()) + '"';
  std::string line;
  FrameReader reader(bytes);
  while (true) {
    const auto frame = reader.next();
    if (!frame) return line + " MALFORMED " + frame.error().message;
    if (!frame.value()) return line;
    line += (line.empty() ? "" : " ") + word_of(*frame.value());
  }
}

// The next packet as a line, "-" when there is none.
inline std::string next(Outbox& outbox, const Now& now = now_ms(0)) {
  const auto packet = outbox.next(now);
  return packet ? line_of(*packet) : "-";
}

// All packets, one line each.
inline std::string drain(Outbox& outbox, const Now& now = now_ms(0)) {
  std::string lines;
  while (const auto packet = outbox.next(now)) lines += line_of(*packet) + "\n";
  return lines;
}

inline void expect_balance(const ChannelCounts& counts) {
  EXPECT_EQ(counts.accepted, counts.sent + counts.dropped.total() + counts.queued);
}

}  // namespace connect_bridge::flow_test
