// What a queue sends as deltas: always against what has left whole.
#include <gtest/gtest.h>

#include <algorithm>

#include "core/compress/compress.hpp"
#include "core/flow/outbox.hpp"
#include "unit/flow/script.hpp"

namespace connect_bridge::flow_test {
namespace {

// A thousand bytes of which half shrinks; its end tells one from another. All but the first share
// 100 bytes that it has not: a delta against one of them is wrong for who has the first only.
OutMessage telling(std::uint8_t last) {
  auto result = message(1000);
  Bytes bytes(1000, 7);
  std::uint32_t state = 1;
  for (std::size_t i = 0; i < 500; ++i) {
    if (i == 400 && last > 1) state = 2;
    state = state * 1664525 + 1013904223;
    bytes[i] = static_cast<std::uint8_t>(state >> 24);
  }
  bytes.back() = last;
  result.body = Payload::adopt(std::move(bytes));
  return result;
}

QueueOptions with_zstd(std::uint32_t depth = 10) {
  auto options = queue(Priority::kNormal);
  options.depth = depth;
  options.compression = {Codec::kZstd, 3};
  return options;
}

// Each message of a packet: "base", "delta", "zstd" or "raw"; "..." while it is not whole.
std::string codecs_of(const Bytes& bytes) {
  constexpr const char* kWords[] = {"raw", "lz4", "zstd", "base", "delta"};
  std::string words;
  FrameReader reader(bytes);
  for (auto frame = reader.next(); frame && frame.value(); frame = reader.next()) {
    const auto* m = std::get_if<MessageFrame>(&*frame.value());
    if (!m) continue;
    words += kWords[static_cast<std::size_t>(m->codec)];
    words += m->part.size() < m->body_bytes ? "... " : " ";
  }
  return words;
}
std::string sent(Outbox& outbox, std::int64_t at = 0) {
  std::string words;
  while (const auto packet = outbox.next(now_ms(at))) words += codecs_of(joined(*packet));
  return words;
}

TEST(OutboxDelta, TheFirstStandsForItself) {
  Outbox outbox{{}};
  outbox.add_channel(kA, with_zstd());
  for (std::uint8_t i = 0; i < 3; ++i) outbox.push(kA, telling(i), now_ms(0));
  EXPECT_EQ(outbox.data_bytes(), 3000U);
  EXPECT_EQ(sent(outbox), "base delta delta ");
  EXPECT_EQ(outbox.data_bytes(), 0U);
  const auto counts = outbox.counts(kA);
  expect_balance(counts);
  EXPECT_LT(counts.sent_bytes, 700U);
  EXPECT_EQ(counts.queued_bytes, 0U);
}

TEST(OutboxDelta, WithoutARateNothingIsDoneAutomatically) {
  Outbox outbox{{}};
  auto options = with_zstd();
  options.compression = {.automatic = true};
  outbox.add_channel(kA, options);
  outbox.push(kA, telling(1), now_ms(2000));
  EXPECT_EQ(sent(outbox, 2000), "raw ");
  EXPECT_TRUE(outbox.acknowledge({outbox.unacknowledged_bytes(), 1}, now_ms(2050)));
  outbox.push(kA, telling(2), now_ms(2050));  // a long way
  EXPECT_EQ(sent(outbox, 2050), "base ");
}

TEST(OutboxDelta, WhatIsUrgentIsLeftAlone) {
  Outbox outbox{{}};
  auto options = queue(Priority::kUrgent);
  options.compression = {.automatic = true};
  outbox.add_channel(kA, options);
  outbox.push(kA, telling(1), now_ms(2000));
  sent(outbox, 2000);
  EXPECT_TRUE(outbox.acknowledge({outbox.unacknowledged_bytes(), 1}, now_ms(2050)));
  outbox.push(kA, telling(2), now_ms(2050));
  EXPECT_EQ(sent(outbox, 2050), "raw ");
}

TEST(OutboxDelta, ANewDemandOrOriginKnowsNothing) {
  Outbox outbox{{}};
  ChannelQueue& of_a = outbox.add_channel(kA, with_zstd());
  outbox.push(kA, telling(1), now_ms(0));
  EXPECT_EQ(sent(outbox), "base ");
  outbox.clear_channel(kA);
  outbox.push(kA, telling(3), now_ms(0));
  EXPECT_EQ(sent(outbox), "base ");
  of_a.forget_base(message(1).subject.origin());
  outbox.push(kA, telling(4), now_ms(0));
  EXPECT_EQ(sent(outbox), "base ");
}

TEST(OutboxDelta, WhereNothingIsDroppedEachStandsForItself) {
  Outbox outbox{{}};
  auto options = with_zstd();
  options.keep = true;  // calls
  outbox.add_channel(kA, options);
  outbox.push(kA, telling(1), now_ms(0));
  outbox.push(kA, telling(2), now_ms(0));
  EXPECT_EQ(sent(outbox), "zstd zstd ");
}

// One queue alone, so that what is dropped can be chosen.
struct Script {
  Script() { queue.push(telling(1), ++arrival, now_ms(0)); }
  std::string take(std::uint32_t part_bytes) {
    EXPECT_TRUE(queue.ready(now_ms(0)));
    queue.prepare(0);
    queue.take_part(part_bytes, packet, now_ms(0));
    return codecs_of(last = joined(packet.finish()));
  }
  // The message that was taken last is `raw` against `base`.
  bool is(const OutMessage& raw, const OutMessage& base) const {
    FrameReader reader(last);
    const auto frame = reader.next();
    const auto* m = std::get_if<MessageFrame>(&*frame.value());
    const auto bytes = decompress_delta(m->part, base.body.view(), m->raw_bytes);
    return bytes && std::ranges::equal(bytes.value(), raw.body.view());
  }

  Budget bases;
  Together together;
  ChannelQueue queue{kA, with_zstd(1), bases, together};
  std::uint64_t arrival = 0;
  PacketBuilder packet;
  Bytes last;
};

TEST(OutboxDelta, WhatIsDisplacedBeforeItLeftIsNoBase) {
  Script s;
  EXPECT_EQ(s.take(5000), "base ");
  s.queue.push(telling(2), ++s.arrival, now_ms(0));
  ASSERT_TRUE(s.queue.ready(now_ms(0)));
  s.queue.prepare(0);  // its turn, but the link is not free
  s.queue.push(telling(3), ++s.arrival, now_ms(0));
  EXPECT_EQ(s.take(5000), "delta ");
  EXPECT_TRUE(s.is(telling(3), telling(1)));
  expect_balance(s.queue.counts());
}

TEST(OutboxDelta, WhatIsGivenUpIsNoBase) {
  Script s;
  EXPECT_EQ(s.take(5000), "base ");
  s.queue.push(telling(2), ++s.arrival, now_ms(0));
  EXPECT_EQ(s.take(10), "delta... ");
  EXPECT_EQ(s.take(10), "");
  EXPECT_TRUE(s.queue.drop_open(DropReason::kQueueBytes));
  s.queue.push(telling(3), ++s.arrival, now_ms(0));
  EXPECT_EQ(s.take(5000), "delta ");
  EXPECT_TRUE(s.is(telling(3), telling(1)));
  expect_balance(s.queue.counts());
}

}  // namespace
}  // namespace connect_bridge::flow_test
