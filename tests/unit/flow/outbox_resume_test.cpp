// Messages that are kept until the peer has them, and are sent again on another connection.
#include <gtest/gtest.h>

#include "core/flow/outbox.hpp"
#include "unit/flow/script.hpp"

namespace connect_bridge::flow_test {
namespace {

OutboxOptions thin() {
  OutboxOptions options;
  options.queue_delay_target = {};
  options.fragment_bytes = 100;
  options.packet_bytes = 1;
  return options;
}

OutMessage resuming(std::size_t size) {
  OutMessage result = message(size);
  result.resumes = true;
  result.raw_bytes = static_cast<std::uint32_t>(size);
  return result;
}

QueueOptions depth(std::uint32_t messages) {
  QueueOptions options = queue(Priority::kNormal);
  options.depth = messages;
  return options;
}

std::string sizes(const std::deque<OutMessage>& messages) {
  std::string line;
  for (const auto& message : messages)
    line +=
        "#" + std::to_string(message.sequence) + ":" + std::to_string(message.body.size()) + " ";
  return line;
}

// What goes on leaves one by one: all packets until there are no more, with their times.
std::string play(Outbox& outbox, const Now& since) {
  std::string lines = drain(outbox, since);
  while (const auto at = outbox.deadline()) {
    const Now now{*at, since.system + (*at - since.steady).count(), 0};
    outbox.on_time(now);
    lines += drain(outbox, now);
  }
  return lines;
}

// The same, with how many microseconds pass before each of them.
std::string pauses(Outbox& outbox, TimePoint since) {
  std::string line;
  while (const auto at = outbox.deadline()) {
    outbox.on_time({*at, 0, 0});
    line += std::to_string((*at - since).count() / 1000) + " ";
    since = *at;
    drain(outbox, {*at, 0, 0});
  }
  return line;
}

std::deque<OutMessage> some_resuming(std::size_t count, std::size_t size) {
  std::deque<OutMessage> result;
  for (std::size_t i = 0; i < count; ++i) result.push_back(resuming(size));
  return result;
}

// Frame headers take 44 bytes.
TEST(OutboxResume, KeepsWhatThePeerDoesNotHave) {
  Outbox outbox(thin());
  outbox.add_channel(kA, depth(100));
  for (const std::size_t size : {10, 20, 250, 30}) outbox.push(kA, resuming(size), now_ms(0));
  EXPECT_EQ(next(outbox), "1#1:10");
  EXPECT_EQ(next(outbox), "1#2:20");
  EXPECT_EQ(next(outbox), "1#3:100/250");  // it is begun and not finished
  ASSERT_TRUE(outbox.acknowledge({54, 1}, now_ms(1)));
  const auto kept = outbox.take_unarrived(kA);
  EXPECT_EQ(sizes(kept.messages), "#2:20 #3:250 #0:30 ");
  EXPECT_EQ(kept.last_sequence, 3U);
  const auto counts = outbox.counts(kA);
  expect_balance(counts);
  EXPECT_EQ(counts.sent, 1U);  // the others are counted where they go
  EXPECT_EQ(counts.queued, 0U);
  EXPECT_EQ(outbox.data_bytes(), 0U);
}

// Otherwise a side would need as much memory as small packets can decompress to.
TEST(OutboxResume, TheWindowCountsWhatIsKeptAsItWas) {
  auto options = thin();
  options.unacknowledged_bytes_max = 5000;
  Outbox outbox(options);
  QueueOptions compressed = depth(100);
  compressed.compression = {Codec::kZstd, 3};
  outbox.add_channel(kA, compressed);
  for (int i = 0; i < 10; ++i) outbox.push(kA, resuming(1000), now_ms(0));
  drain(outbox);
  EXPECT_EQ(outbox.counts(kA).sent, 5U);  // one is begun while there is room
  EXPECT_LT(outbox.unacknowledged_bytes(), 1000U);
  // Others do not wait for it.
  outbox.add_channel(kB, queue(Priority::kHigh));
  outbox.push(kB, message(10), now_ms(0));
  drain(outbox);
  EXPECT_EQ(outbox.counts(kB).sent, 1U);
  ASSERT_TRUE(outbox.acknowledge({outbox.unacknowledged_bytes(), 1}, now_ms(1)));
  drain(outbox);
  EXPECT_EQ(outbox.counts(kA).sent, 10U);
}

TEST(OutboxResume, NothingIsKeptOfAChannelThatIsRemoved) {
  auto options = thin();
  options.unacknowledged_bytes_max = 5000;
  Budget memory(100'000);  // outlives the outbox
  Outbox outbox(options);
  outbox.draw_from(memory);
  outbox.add_channel(kA, depth(100));
  outbox.push(kA, resuming(4500), now_ms(0));
  drain(outbox);
  EXPECT_GE(memory.used(), 4500U);
  outbox.remove_channel(kA);
  next(outbox);
  EXPECT_EQ(memory.used(), 0U);
  ASSERT_TRUE(outbox.acknowledge({outbox.unacknowledged_bytes(), 1}, now_ms(1)));
  outbox.add_channel(kA, depth(100));
  for (int i = 0; i < 2; ++i) {
    outbox.push(kA, resuming(600), now_ms(0));
    drain(outbox);
  }
  EXPECT_EQ(outbox.counts(kA).sent, 2U);
}

TEST(OutboxResume, LeavesWhatDoesNotResume) {
  Outbox outbox(thin());
  outbox.add_channel(kA, depth(100));
  outbox.push(kA, message(10), now_ms(0));
  outbox.push(kA, resuming(20), now_ms(0));
  outbox.push(kA, message(30), now_ms(0));
  EXPECT_EQ(next(outbox), "1#1:10");
  EXPECT_EQ(sizes(outbox.take_unarrived(kA).messages), "#0:20 ");
  EXPECT_EQ(outbox.counts(kA).queued, 1U);
  EXPECT_EQ(drain(outbox), "1#2:30\n");
}

TEST(OutboxResume, WhatWasSentForADemandThatEndedIsNotKept) {
  Outbox outbox(thin());
  outbox.add_channel(kA, depth(100));
  outbox.push(kA, resuming(10), now_ms(0));
  next(outbox);
  outbox.clear_channel(kA);
  outbox.push(kA, resuming(20), now_ms(0));
  next(outbox);
  ASSERT_TRUE(outbox.acknowledge({54, 1}, now_ms(1)));  // the first one: it is nobody's
  EXPECT_EQ(sizes(outbox.take_unarrived(kA).messages), "#2:20 ");
}

TEST(OutboxResume, GoesOnWithTheNumbersOfTheConnectionBefore) {
  Outbox before(thin());
  before.add_channel(kA, depth(100));
  before.push(kA, resuming(10), now_ms(0));
  next(before);
  before.push(kA, resuming(20), now_ms(0));
  auto kept = before.take_unarrived(kA);

  Outbox after(thin());
  after.add_channel(kB, depth(100));
  after.go_on(kB, std::move(kept), now_ms(0), now_ms(1000).steady);
  after.push(kB, resuming(30), now_ms(0));
  EXPECT_EQ(play(after, now_ms(0)), "2#1:10\n2#2:20\n2#3:30\n");
  expect_balance(after.counts(kB));
  EXPECT_EQ(sizes(after.take_unarrived(kB).messages), "#1:10 #2:20 #3:30 ");
}

TEST(OutboxResume, DepthDoesNotLimitWhatGoesOnNorWhatJoinsItInTime) {
  Outbox outbox(thin());
  const ChannelQueue& of_a = outbox.add_channel(kA, depth(2));
  std::deque<OutMessage> kept;
  for (const std::size_t size : {11, 12, 13}) kept.push_back(resuming(size));
  outbox.go_on(kA, {std::move(kept)}, now_ms(0), now_ms(1000).steady);
  for (const std::size_t size : {21, 22, 23}) outbox.push(kA, resuming(size), now_ms(500));
  for (const std::size_t size : {31, 32, 33}) outbox.push(kA, resuming(size), now_ms(1000));
  EXPECT_TRUE(of_a.holds(OriginId{}));
  EXPECT_EQ(play(outbox, now_ms(1000)),
            "1#1:11\n1#2:12\n1#3:13\n1#4:21\n1#5:22\n1#6:23\n1#7:32\n1#8:33\n");
  EXPECT_FALSE(of_a.holds(OriginId{}));
  EXPECT_EQ(outbox.counts(kA).dropped.of(DropReason::kQueueDepth), 1U);
  expect_balance(outbox.counts(kA));
}

// A subscriber with a short queue loses what comes faster than it looks.
TEST(OutboxResume, WhatGoesOnLeavesOneByOneAndHoldsUpNobodyElse) {
  Outbox outbox(thin());
  outbox.add_channel(kA, depth(100));
  outbox.add_channel(kB, depth(100));
  outbox.go_on(kA, {some_resuming(3, 10)}, now_ms(0), now_ms(1000).steady);
  outbox.push(kB, message(20), now_ms(0));
  outbox.push(kB, message(21), now_ms(0));
  EXPECT_EQ(drain(outbox), "1#1:10\n2#1:20\n2#2:21\n");
  EXPECT_EQ(outbox.deadline(), now_ms(0).steady + Replay::kApartMost);
  outbox.push(kA, resuming(30), now_ms(0));  // behind the others
  outbox.push(kB, message(22), now_ms(0));
  EXPECT_EQ(drain(outbox), "2#3:22\n");
  EXPECT_EQ(pauses(outbox, now_ms(0).steady), "2000 2000 2000 ");
  EXPECT_EQ(outbox.counts(kA).sent, 4U);
  for (int i = 0; i < 3; ++i) outbox.push(kA, resuming(40), now_ms(6));  // as usual
  EXPECT_EQ(drain(outbox, now_ms(6)), "1#5:40\n1#6:40\n1#7:40\n");
}

TEST(OutboxResume, WhatRestsMayBeDroppedAndTheChannelMayGo) {
  auto options = thin();
  options.data_bytes_max = 1000;
  Outbox outbox(options);
  outbox.add_channel(kA, depth(10));
  outbox.add_channel(kB, depth(10));
  outbox.go_on(kA, {some_resuming(3, 100)}, now_ms(0), now_ms(1000).steady);
  drain(outbox);
  outbox.push(kB, message(900), now_ms(0));
  EXPECT_EQ(outbox.counts(kA).dropped.of(DropReason::kQueueBytes), 1U);
  outbox.add_channel(kA, queue(Priority::kHigh));  // it rests all the same
  EXPECT_EQ(drain(outbox).substr(0, 3), "2#1");
  EXPECT_EQ(outbox.deadline(), now_ms(0).steady + Replay::kApartMost);
  outbox.remove_channel(kA);
  EXPECT_EQ(outbox.deadline(), std::nullopt);
  EXPECT_EQ(play(outbox, now_ms(0)), "");
}

TEST(OutboxResume, TheLinksBudgetLimitsWhatGoesOn) {
  auto options = thin();
  options.data_bytes_max = 100;
  Outbox outbox(options);
  outbox.add_channel(kA, depth(2));
  std::deque<OutMessage> kept;
  for (const std::size_t size : {60, 61, 30}) kept.push_back(resuming(size));
  outbox.go_on(kA, {std::move(kept)}, now_ms(0), now_ms(1000).steady);
  EXPECT_EQ(play(outbox, now_ms(0)), "1#1:61\n1#2:30\n");
  EXPECT_EQ(outbox.counts(kA).dropped.of(DropReason::kQueueBytes), 1U);
}

}  // namespace
}  // namespace connect_bridge::flow_test
