// What leaves next: classes, turns, fragments, gathering.
#include "core/flow/outbox.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "unit/flow/script.hpp"

namespace connect_bridge::flow_test {
namespace {

// Parts of 100 bytes, gathered up to 300 bytes of packet.
OutboxOptions gathered() {
  OutboxOptions options;
  options.queue_delay_target = {};  // nothing is paced and no ack is asked for
  options.fragment_bytes = 100;
  options.packet_bytes = 300;
  return options;
}

// The receiver handles all frames of a packet in one turn of its loop.
TEST(OutboxOrder, APacketHasNoMoreFramesThanAPeerTakes) {
  OutboxOptions options;
  options.queue_delay_target = {};
  Outbox outbox(options);
  QueueOptions all_of_them = queue(Priority::kNormal);
  all_of_them.depth = 0;
  outbox.add_channel(kA, all_of_them);
  for (int n = 0; n < 3000; ++n) outbox.push(kA, message(1), now_ms(0));
  std::size_t all = 0;
  while (const auto packet = outbox.next(now_ms(0))) {
    const Bytes bytes = joined(*packet);
    FrameReader reader(bytes);
    std::size_t frames = 0;
    while (reader.next().value()) ++frames;
    EXPECT_LE(frames, kPacketFramesMax);
    all += frames;
  }
  EXPECT_EQ(all, 3000U);
}

TEST(OutboxOrder, WhatIsNotBegunCanBeTakenBack) {
  Outbox outbox(one_by_one());
  outbox.add_channel(kA, queue(Priority::kNormal));
  for (std::uint32_t subject = 7; subject <= 9; ++subject) {
    OutMessage sent = message(150);
    sent.subject = subject;
    outbox.push(kA, std::move(sent), now_ms(0));
  }
  EXPECT_EQ(next(outbox), "1#1:100/150");
  EXPECT_FALSE(outbox.take_back(kA, 7)) << "it is begun";
  EXPECT_TRUE(outbox.take_back(kA, 8));
  EXPECT_FALSE(outbox.take_back(kA, 8));
  EXPECT_FALSE(outbox.take_back(kB, 9)) << "there is no such channel";
  EXPECT_EQ(drain(outbox), "1+50\n1#2:100/150\n1+50\n");
  EXPECT_EQ(dropped(outbox, kA, DropReason::kNoDemand), 1U);
  expect_balance(outbox.counts(kA));
  EXPECT_EQ(outbox.data_bytes(), 0U);
}

TEST(OutboxOrder, ManyEndsOfMessagesTakeSeveralPackets) {
  OutboxOptions options = gathered();
  options.unacknowledged_bytes_max = 16 << 20;
  Outbox outbox(options);
  constexpr std::uint32_t kChannels = 2000;
  for (std::uint32_t n = 1; n <= kChannels; ++n) {
    outbox.add_channel({n}, queue(Priority::kNormal));
    outbox.push({n}, message(n == 1 ? 6000 : 5000 - n), now_ms(0));
    next(outbox);  // a part of each: the next one is smaller
  }
  for (std::uint32_t n = 1; n <= kChannels; ++n) outbox.clear_channel({n});
  outbox.push(kA, message(12), now_ms(0));
  std::size_t ends = 0;
  std::string line;
  while ((line = next(outbox)) != "-") {
    const auto in_this = static_cast<std::size_t>(std::count(line.begin(), line.end(), '!'));
    EXPECT_LE(in_this, kPacketFramesMax);
    EXPECT_TRUE(ends + in_this >= kChannels || line.find(':') == std::string::npos) << line;
    ends += in_this;
  }
  EXPECT_GT(ends, kPacketFramesMax);
}

TEST(OutboxOrder, NothingIsNoPacket) {
  Outbox outbox(gathered());
  EXPECT_EQ(next(outbox), "-");
  outbox.add_channel(kA, {});
  EXPECT_EQ(next(outbox), "-");
}

TEST(OutboxOrder, SmallThenControlThenData) {
  Outbox outbox(gathered());
  outbox.add_channel(kA, queue(Priority::kHigh));
  outbox.push(kA, message(12), now_ms(0));
  outbox.push_small(TimeRequest{1});
  outbox.push_small(AckFrame{5});
  outbox.push_small(AckFrame{9});  // replaces the older one
  ASSERT_TRUE(outbox.push_control({"{1}"}));
  ASSERT_TRUE(outbox.push_control({"{2}"}));
  EXPECT_EQ(drain(outbox), "ack 9 ask\n\"{1}\"\n\"{2}\"\n1#1:12\n");
}

// Many texts wait after a reconnect: what measures the link does not wait for all of them, nor do
// they for it.
TEST(OutboxOrder, SmallFramesAndTextsTakeTurns) {
  Outbox outbox(gathered());
  for (const char* text : {"{1}", "{2}", "{3}"}) ASSERT_TRUE(outbox.push_control({text}));
  std::string lines;
  for (std::uint64_t received = 1; received <= 3; ++received) {
    outbox.push_small(AckFrame{received});
    lines += next(outbox) + "\n";
    lines += next(outbox) + "\n";
  }
  EXPECT_EQ(lines, "ack 1\n\"{1}\"\n\"{2}\"\nack 2\n\"{3}\"\nack 3\n");
}

TEST(OutboxOrder, SmallMessagesShareAPacketAndOnePiece) {
  Outbox outbox(gathered());
  outbox.add_channel(kA, {});
  for (int i = 0; i < 7; ++i) outbox.push(kA, message(6), now_ms(0));  // 50 bytes each with header
  const auto packet = outbox.next(now_ms(0));
  EXPECT_EQ(packet->pieces.size(), 1U);
  EXPECT_EQ(line_of(*packet), "1#1:6 1#2:6 1#3:6 1#4:6 1#5:6 1#6:6");
  EXPECT_EQ(next(outbox), "1#7:6");
}

TEST(OutboxOrder, LargePartsAreReferredTo) {
  Outbox outbox(OutboxOptions{});
  outbox.add_channel(kA, {});
  auto large = message(kCopiedPartBytesMax + 1);
  const auto* bytes = large.body.view().data();
  outbox.push(kA, message(kCopiedPartBytesMax), now_ms(0));
  outbox.push(kA, std::move(large), now_ms(0));
  outbox.push(kA, message(0), now_ms(0));
  const auto packet = outbox.next(now_ms(0));
  ASSERT_EQ(packet->pieces.size(), 3U);
  EXPECT_EQ(packet->pieces[1].view().data(), bytes);
  EXPECT_EQ(line_of(*packet), "1#1:512 1#2:513 1#3:0");
}

TEST(OutboxOrder, APartThatFitsNoPacketEndsOne) {
  auto options = gathered();
  options.fragment_bytes = 1000;
  Outbox outbox(options);
  outbox.add_channel(kA, queue(Priority::kHigh));
  outbox.add_channel(kB, queue(Priority::kBulk));
  outbox.push(kA, message(12), now_ms(0));
  outbox.push(kB, message(1500), now_ms(0));
  outbox.push(kA, message(12), now_ms(0));
  EXPECT_EQ(drain(outbox), "1#1:12 2#1:1000/1500\n1#2:12 2+500\n");
}

TEST(OutboxOrder, APartThatFitsTheNextPacketWaitsForIt) {
  Outbox outbox(gathered());
  outbox.add_channel(kA, {});
  outbox.push(kA, message(90), now_ms(0));
  outbox.push(kA, message(90), now_ms(0));
  outbox.push(kA, message(90), now_ms(0));  // 378 bytes with headers
  EXPECT_EQ(drain(outbox), "1#1:90 1#2:90\n1#3:90\n");
}

TEST(OutboxOrder, UrgentPassesAnOpenBulkMessage) {
  Outbox outbox(one_by_one());
  outbox.add_channel(kA, queue(Priority::kUrgent));
  outbox.add_channel(kB, queue(Priority::kBulk));
  outbox.push(kB, message(350), now_ms(0));
  EXPECT_EQ(next(outbox), "2#1:100/350");
  EXPECT_EQ(next(outbox), "2+100");
  outbox.push(kA, message(12), now_ms(0));
  outbox.push(kA, message(12), now_ms(0));
  EXPECT_EQ(drain(outbox), "1#1:12\n1#2:12\n2+100\n2+50\n");
}

TEST(OutboxOrder, BulkGetsItsShareBesideAFloodOfSmallMessages) {
  OutboxOptions options;
  options.queue_delay_target = {};
  options.fragment_bytes = 65'536;
  options.packet_bytes = 16'384;
  Outbox outbox(options);
  auto flood = queue(Priority::kNormal);
  flood.depth = 1000;
  outbox.add_channel(kA, flood);
  outbox.add_channel(kB, queue(Priority::kBulk));
  outbox.push(kB, message(30'000'000), now_ms(0));
  std::uint64_t bulk = 0;
  std::uint64_t all = 0;
  while (all < 10'000'000) {
    for (int i = 0; i < 1000; ++i) outbox.push(kA, message(12), now_ms(0));
    const auto packet = outbox.next(now_ms(0));
    ASSERT_TRUE(packet);
    all += packet->size();
    if (packet->size() > 60'000) bulk += 65'536;
    ASSERT_TRUE(outbox.acknowledge({all}, {}));
  }
  EXPECT_NEAR(static_cast<double>(bulk) / static_cast<double>(all), 0.2, 0.02);  // 1 of 4 + 1
}

QueueOptions may_be_light(Priority priority) {
  auto options = queue(priority);
  options.may_be_light = true;
  return options;
}

TEST(OutboxLight, ASmallMessageOfNoPriorityLeavesBehindUrgentAndBeforeTheRest) {
  Outbox outbox(one_by_one());
  outbox.add_channel(kA, queue(Priority::kHigh));
  outbox.add_channel(kB, may_be_light(Priority::kNormal));
  outbox.add_channel(kC, queue(Priority::kUrgent));
  outbox.push(kA, message(10), now_ms(0));
  outbox.push(kB, message(20), now_ms(0));
  outbox.push(kC, message(30), now_ms(0));
  EXPECT_EQ(drain(outbox), "3#1:30\n2#1:20\n1#1:10\n");
}

TEST(OutboxLight, ALargeOneWaitsForItsTurnAndKeepsTheOrderOfItsChannel) {
  Outbox outbox(one_by_one());
  outbox.add_channel(kA, queue(Priority::kHigh));
  outbox.add_channel(kB, may_be_light(Priority::kNormal));
  outbox.push(kB, message(20), now_ms(0));
  outbox.push(kB, message(kLightBytes + 1), now_ms(0));
  outbox.push(kA, message(10), now_ms(0));
  EXPECT_EQ(next(outbox), "1#1:10");
  EXPECT_EQ(next(outbox), "2#1:20");
}

// 100 messages wait on kB, more than may be light; kA has a higher priority.
void flood(Outbox& outbox) {
  auto keep_all = may_be_light(Priority::kBulk);
  keep_all.depth = 0;
  outbox.add_channel(kB, keep_all);
  outbox.add_channel(kA, queue(Priority::kHigh));
  for (int i = 0; i < 100; ++i) outbox.push(kB, message(100), now_ms(0));
}

TEST(OutboxLight, AFloodIsNotLight) {
  Outbox outbox(one_by_one());
  flood(outbox);
  outbox.push(kA, message(10), now_ms(0));
  EXPECT_EQ(next(outbox), "1#1:10");
  drain(outbox);
  outbox.push(kB, message(100), now_ms(10'000));  // paid off meanwhile
  outbox.push(kA, message(10), now_ms(10'000));
  EXPECT_EQ(next(outbox), "2#101:100");
}

TEST(OutboxLight, WhatIsLeftOfAFloodDoesNotBecomeLight) {
  Outbox outbox(one_by_one());
  flood(outbox);
  outbox.push(kB, message(100), now_ms(10'000));  // for which there is room
  outbox.push(kA, message(10), now_ms(10'000));
  EXPECT_EQ(next(outbox), "1#1:10");
}

TEST(OutboxOrder, UrgentIsFirstWhateverElseWaits) {
  Outbox outbox(OutboxOptions{});
  const Priority classes[] = {Priority::kUrgent, Priority::kHigh, Priority::kNormal,
                              Priority::kBulk};
  std::uint32_t id = 0;
  for (const auto priority : classes) outbox.add_channel(ChannelId{++id}, queue(priority));
  for (int round = 0; round < 50; ++round) {
    outbox.push(kB, message(100'000), now_ms(0));
    outbox.push(kC, message(100'000), now_ms(0));
    outbox.push(kD, message(100'000), now_ms(0));
    outbox.push(kA, message(12), now_ms(0));
    EXPECT_EQ(next(outbox).rfind("1#", 0), 0U);
  }
}

TEST(OutboxOrder, AChannelCanChangeItsClassWhileItWaits) {
  Outbox outbox(one_by_one());
  outbox.add_channel(kA, queue(Priority::kBulk));
  outbox.add_channel(kB, queue(Priority::kHigh));
  outbox.push(kA, message(12), now_ms(0));
  outbox.push(kB, message(12), now_ms(0));
  outbox.add_channel(kA, queue(Priority::kUrgent));
  EXPECT_EQ(drain(outbox), "1#1:12\n2#1:12\n");
}

// The options of a topic change with its publishers, which may come and go all the time.
TEST(OutboxOrder, AChannelWhoseOptionsChangeKeepsItsTurn) {
  Outbox outbox(one_by_one());
  for (const auto channel : {kA, kB}) outbox.add_channel(channel, queue(Priority::kBulk));
  outbox.push(kA, message(1000), now_ms(0));
  int others = 0;
  for (bool begun = false; !begun && others < 100; ++others) {
    outbox.push(kB, message(50), now_ms(0));
    outbox.add_channel(kA, queue(Priority::kBulk));
    begun = next(outbox).starts_with("1");
  }
  EXPECT_LE(others, 1000 / 50 + 2);
}

TEST(OutboxOrder, PacketsStayBelowWhatReceiversTake) {
  OutboxOptions options;
  options.queue_delay_target = {};
  options.fragment_bytes = 4'000'000'000;
  options.packet_bytes = 4'000'000'000;
  Outbox outbox(options);
  auto keep_all = queue(Priority::kNormal);
  keep_all.depth = 0;
  keep_all.queue_bytes_max = 64 << 20;
  outbox.add_channel(kA, keep_all);
  outbox.add_channel(kB, keep_all);
  for (int i = 0; i < 20'000; ++i) outbox.push(kB, message(100), now_ms(0));
  for (int i = 0; i < 3; ++i) outbox.push(kA, message(3'000'000), now_ms(0));
  while (const auto packet = outbox.next(now_ms(0))) {
    EXPECT_LE(packet->size(), kPacketBytesMax);
  }
  EXPECT_EQ(outbox.data_bytes(), 0U);
}

}  // namespace
}  // namespace connect_bridge::flow_test
