#include "unit/flow/script.hpp"

#include <variant>

namespace connect_bridge::flow_test {
namespace {

std::string word_of(const Frame& frame) {
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
  if (std::holds_alternative<AckRequest>(frame)) return "at once";
  if (const auto* texts = std::get_if<TextsFrame>(&frame))
    return "texts of " + std::to_string(texts->raw_bytes);
  return std::holds_alternative<TimeRequest>(frame) ? "ask" : "answer";
}

}  // namespace

Stamp at_ms(std::int64_t ms) {
  return kStart + ms * 1'000'000;
}
Now now_ms(std::int64_t ms) {
  return Now{TimePoint{std::chrono::milliseconds(ms)}, at_ms(ms), 0};
}

OutMessage message(std::size_t size, Stamp stamp) {
  OutMessage result;
  result.subject = OriginId{7};
  result.stamp = stamp;
  result.body = Payload::adopt(Bytes(size, static_cast<std::uint8_t>(size)));
  return result;
}

QueueOptions queue(Priority priority) {
  QueueOptions options;
  options.priority = priority;
  return options;
}

OutboxOptions one_by_one() {
  OutboxOptions options;
  options.queue_delay_target = {};
  options.fragment_bytes = 100;
  options.packet_bytes = 1;
  return options;
}

Bytes joined(const Packet& packet) {
  Bytes bytes;
  for (const auto& piece : packet.pieces) {
    bytes.insert(bytes.end(), piece.view().begin(), piece.view().end());
  }
  return bytes;
}

std::string line_of(const Packet& packet) {
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

std::string next(Outbox& outbox, const Now& now) {
  const auto packet = outbox.next(now);
  return packet ? line_of(*packet) : "-";
}

std::string drain(Outbox& outbox, const Now& now) {
  std::string lines;
  while (const auto packet = outbox.next(now)) lines += line_of(*packet) + "\n";
  return lines;
}

void expect_balance(const ChannelCounts& counts) {
  EXPECT_EQ(counts.accepted, counts.sent + counts.dropped.total() + counts.queued);
}

std::uint64_t dropped(const Outbox& outbox, ChannelId channel, DropReason reason) {
  const auto counts = outbox.counts(channel);
  expect_balance(counts);
  return counts.dropped.of(reason);
}

}  // namespace connect_bridge::flow_test
