// What is dropped, when, under which reason; the window; ends of channels and connections.
#include <gtest/gtest.h>

#include <limits>

#include "core/flow/outbox.hpp"
#include "unit/flow/script.hpp"

namespace connect_bridge::flow_test {
namespace {

using std::chrono::milliseconds;

TEST(OutboxQueue, APacketSaysWhetherAnotherFollows) {
  Outbox outbox(one_by_one());
  outbox.add_channel(kA, queue(Priority::kNormal));
  const auto more = [&] { return outbox.next(now_ms(0)).value().more; };
  outbox.push(kA, message(250), now_ms(0));
  EXPECT_TRUE(more());
  EXPECT_TRUE(more());
  EXPECT_FALSE(more());
  EXPECT_TRUE(outbox.push_control({"text"}));
  EXPECT_FALSE(more());
  EXPECT_TRUE(outbox.push_control({"text"}));
  outbox.push_small(TimeRequest{1});
  EXPECT_TRUE(more());
  EXPECT_FALSE(more());
  outbox.push(kA, message(150), now_ms(0));
  EXPECT_TRUE(more());
  outbox.clear_channel(kA);  // its open message is aborted
  EXPECT_FALSE(more());
  EXPECT_EQ(next(outbox), "-");
}

TEST(OutboxQueue, KeepLastDropsTheOldest) {
  Outbox outbox(one_by_one());
  auto options = queue(Priority::kNormal);
  options.depth = 2;
  outbox.add_channel(kA, options);
  for (const std::size_t size : {11, 12, 13, 14}) outbox.push(kA, message(size), now_ms(0));
  EXPECT_EQ(drain(outbox), "1#1:13\n1#2:14\n");
  EXPECT_EQ(dropped(outbox, kA, DropReason::kQueueDepth), 2U);
  EXPECT_EQ(outbox.counts(kA).sent_bytes, 27U);
}

TEST(OutboxQueue, NewestOnlyHasAReasonOfItsOwn) {
  Outbox outbox(one_by_one());
  auto options = queue(Priority::kUrgent);
  options.newest_only = true;
  options.depth = 0;  // does not matter then
  options.queue_bytes_max = 1;
  outbox.add_channel(kA, options);
  for (const std::size_t size : {11, 12, 13}) outbox.push(kA, message(size), now_ms(0));
  EXPECT_EQ(drain(outbox), "1#1:13\n");
  EXPECT_EQ(dropped(outbox, kA, DropReason::kNewerAvailable), 2U);
}

TEST(OutboxQueue, AnOpenMessageIsNeverDisplaced) {
  Outbox outbox(one_by_one());
  auto options = queue(Priority::kBulk);
  options.newest_only = true;
  outbox.add_channel(kA, options);
  outbox.push(kA, message(150), now_ms(0));
  EXPECT_EQ(next(outbox), "1#1:100/150");
  outbox.push(kA, message(11), now_ms(0));
  outbox.push(kA, message(12), now_ms(0));
  EXPECT_EQ(outbox.counts(kA).queued, 2U);
  EXPECT_EQ(drain(outbox), "1+50\n1#2:12\n");
  EXPECT_EQ(dropped(outbox, kA, DropReason::kNewerAvailable), 1U);
}

TEST(OutboxQueue, BytesAreKeptExactly) {
  Outbox outbox(one_by_one());
  auto options = queue(Priority::kNormal);
  options.queue_bytes_max = 100;
  outbox.add_channel(kA, options);
  outbox.push(kA, message(60), now_ms(0));
  outbox.push(kA, message(40), now_ms(0));
  EXPECT_EQ(outbox.counts(kA).queued_bytes, 100U);
  outbox.push(kA, message(1), now_ms(0));  // one byte too many: the oldest goes
  EXPECT_EQ(outbox.counts(kA).queued_bytes, 41U);
  outbox.push(kA, message(1000), now_ms(0));  // one message always fits an empty queue
  EXPECT_EQ(outbox.counts(kA).queued_bytes, 1000U);
  EXPECT_EQ(dropped(outbox, kA, DropReason::kQueueBytes), 3U);
}

TEST(OutboxQueue, ABurstMayTakeMoreUntilTheOldestWaitsForLong) {
  auto small = one_by_one();
  small.data_bytes_max = 1200;
  Outbox outbox(small);
  auto options = queue(Priority::kNormal);
  options.queue_bytes_max = 100;
  options.burst_bytes_max = 5000;
  outbox.add_channel(kA, options);
  for (int i = 0; i < 3; ++i) outbox.push(kA, message(100), now_ms(0));
  EXPECT_EQ(outbox.counts(kA).queued_bytes, 300U);
  outbox.push(kA, message(100), now_ms(250));  // beyond a quarter of what the link may hold
  EXPECT_EQ(outbox.counts(kA).queued_bytes, 300U);
  EXPECT_EQ(dropped(outbox, kA, DropReason::kQueueBytes), 1U);
  outbox.push(kA, message(10), now_ms(251));  // those of 0 ms go; the one of 250 ms has time
  EXPECT_EQ(outbox.counts(kA).queued_bytes, 110U);
  outbox.push(kA, message(10), now_ms(501));
  EXPECT_EQ(outbox.counts(kA).queued_bytes, 20U);
}

TEST(OutboxQueue, KeepAllRefusesTheNewest) {
  Outbox outbox(one_by_one());
  auto options = queue(Priority::kNormal);
  options.depth = 0;
  options.queue_bytes_max = 100;
  outbox.add_channel(kA, options);
  outbox.push(kA, message(60), now_ms(0));
  outbox.push(kA, message(41), now_ms(0));
  outbox.push(kA, message(40), now_ms(0));
  EXPECT_EQ(drain(outbox), "1#1:60\n1#2:40\n");
  EXPECT_EQ(dropped(outbox, kA, DropReason::kQueueBytes), 1U);
  outbox.push(kA, message(1000), now_ms(0));
  EXPECT_EQ(outbox.counts(kA).queued, 1U);
}

TEST(OutboxQueue, AgeIsCheckedWhenQueuedAndWhenStarted) {
  Outbox outbox(one_by_one());
  auto options = queue(Priority::kNormal);
  options.lifespan = milliseconds(100);
  options.max_age = milliseconds(50);
  outbox.add_channel(kA, options);
  outbox.push(kA, message(11, at_ms(0)),
              now_ms(101));  // too old for both: the origin's limit counts
  outbox.push(kA, message(12, at_ms(0)), now_ms(51));
  outbox.push(kA, message(13, at_ms(0)), now_ms(50));  // exactly as old as allowed
  outbox.push(kA, message(14, at_ms(10)), now_ms(50));
  EXPECT_EQ(outbox.counts(kA).queued, 2U);
  EXPECT_EQ(drain(outbox, now_ms(55)), "1#1:14\n");
  EXPECT_EQ(dropped(outbox, kA, DropReason::kLifespan), 1U);
  EXPECT_EQ(dropped(outbox, kA, DropReason::kMaxAge), 2U);
}

TEST(OutboxQueue, AStartedMessageIsFinishedHoweverOld) {
  Outbox outbox(one_by_one());
  auto options = queue(Priority::kNormal);
  options.max_age = milliseconds(50);
  outbox.add_channel(kA, options);
  outbox.push(kA, message(150, at_ms(0)), now_ms(0));
  EXPECT_EQ(next(outbox, now_ms(0)), "1#1:100/150");
  EXPECT_EQ(next(outbox, now_ms(1000)), "1+50");
}

TEST(OutboxQueue, SequencesGoFromTheLargestToOne) {
  Budget bases;
  Together together;
  ChannelQueue channel(kA, {}, bases, together);
  channel.restart(std::numeric_limits<std::uint32_t>::max() - 1);
  PacketBuilder packet;
  for (std::uint64_t arrival = 1; arrival <= 2; ++arrival) {
    channel.push(message(12), arrival, now_ms(0));
    ASSERT_TRUE(channel.ready(now_ms(0)));
    channel.take_part(100, packet, now_ms(0));
  }
  EXPECT_EQ(line_of(packet.finish()), "1#4294967295:12 1#1:12");
}

TEST(OutboxQueue, UnknownTimesHaveNoAge) {
  Outbox outbox(one_by_one());
  auto options = queue(Priority::kNormal);
  options.lifespan = options.max_age = Duration::zero();
  outbox.add_channel(kA, options);
  outbox.push(kA, message(11, 0), now_ms(1000));         // no stamp
  outbox.push(kA, message(12, at_ms(5000)), now_ms(0));  // from the future
  outbox.push(kA, message(13, at_ms(0)), Now{});         // no clock
  EXPECT_EQ(outbox.counts(kA).queued, 3U);
  constexpr auto kMin = std::numeric_limits<Stamp>::min();
  outbox.push(kA, message(14, kMin), now_ms(0));  // its age fits no Stamp
  EXPECT_EQ(dropped(outbox, kA, DropReason::kLifespan), 1U);
}

TEST(OutboxBudget, TheOldestOfTheLowestClassGoes) {
  auto options = one_by_one();
  options.data_bytes_max = 100;
  Outbox outbox(options);
  outbox.add_channel(kA, queue(Priority::kUrgent));
  outbox.add_channel(kB, queue(Priority::kNormal));
  outbox.add_channel(kC, queue(Priority::kBulk));
  outbox.add_channel(kD, queue(Priority::kBulk));
  outbox.push(kD, message(30), now_ms(0));
  outbox.push(kC, message(30), now_ms(0));
  outbox.push(kB, message(40), now_ms(0));
  EXPECT_EQ(outbox.data_bytes(), 100U);
  outbox.push(kA, message(1), now_ms(0));
  EXPECT_EQ(dropped(outbox, kD, DropReason::kQueueBytes), 1U);
  EXPECT_EQ(outbox.data_bytes(), 71U);
  outbox.push(kA, message(60), now_ms(0));
  EXPECT_EQ(dropped(outbox, kC, DropReason::kQueueBytes), 1U);
  EXPECT_EQ(dropped(outbox, kB, DropReason::kQueueBytes), 1U);
  outbox.push(kC, message(40), now_ms(0));  // no room is made for it by higher classes
  EXPECT_EQ(dropped(outbox, kC, DropReason::kQueueBytes), 2U);
  EXPECT_EQ(drain(outbox), "1#1:1\n1#2:60\n");
}

TEST(OutboxBudget, AnOpenMessageGoesForAHigherClassOnly) {
  auto options = one_by_one();
  options.data_bytes_max = 1000;
  Outbox outbox(options);
  outbox.add_channel(kA, queue(Priority::kUrgent));
  outbox.add_channel(kB, queue(Priority::kBulk));
  outbox.push(kB, message(1000), now_ms(0));
  EXPECT_EQ(next(outbox), "2#1:100/1000");
  outbox.push(kB, message(1), now_ms(0));
  EXPECT_EQ(dropped(outbox, kB, DropReason::kQueueBytes), 1U);
  EXPECT_EQ(next(outbox), "2+100");
  outbox.push(kA, message(1), now_ms(0));
  EXPECT_EQ(dropped(outbox, kB, DropReason::kQueueBytes), 2U);
  EXPECT_EQ(outbox.data_bytes(), 1U);
  EXPECT_EQ(drain(outbox), "2!\n1#1:1\n");
}

TEST(OutboxBudget, ControlTextsBeyondTheirBudgetAreRefused) {
  auto options = one_by_one();
  options.control_bytes_max = 10;
  Outbox outbox(options);
  EXPECT_TRUE(outbox.push_control({"12345"}));
  EXPECT_TRUE(outbox.push_control({"67890"}));
  EXPECT_FALSE(outbox.push_control({"1"}));
  EXPECT_EQ(drain(outbox), "\"12345\"\n\"67890\"\n");
  EXPECT_TRUE(outbox.push_control({"1"}));
}

// A window of three parts of 100 bytes with their headers: 144 + 112 + 112.
OutboxOptions narrow() {
  auto options = one_by_one();
  options.unacknowledged_bytes_max = 368 + kAckRequestBytes;
  return options;
}

TEST(OutboxWindow, DataStopsExactlyThereAndGoesOnWithAcks) {
  Outbox outbox(narrow());
  outbox.add_channel(kB, queue(Priority::kHigh));
  outbox.push(kB, message(1000), now_ms(0));
  EXPECT_EQ(drain(outbox), "2#1:100/1000\n2+100\n2+100\n");
  EXPECT_EQ(outbox.unacknowledged_bytes(), 368U);
  EXPECT_TRUE(outbox.acknowledge({111}, {}));
  EXPECT_EQ(next(outbox), "-");
  EXPECT_TRUE(outbox.acknowledge({112}, {}));
  EXPECT_EQ(next(outbox), "2+100");
  EXPECT_TRUE(outbox.acknowledge({5}, {}));  // an old one takes nothing back
  EXPECT_EQ(outbox.unacknowledged_bytes(), 368U);
  EXPECT_FALSE(outbox.acknowledge({481}, {}));  // more than was sent
  EXPECT_TRUE(outbox.acknowledge({480}, {}));
  EXPECT_EQ(outbox.unacknowledged_bytes(), 0U);
}

TEST(OutboxWindow, UrgentHasAReserveAndAcksAreNeverHeldBack) {
  Outbox outbox(narrow());
  outbox.add_channel(kA, queue(Priority::kUrgent));
  outbox.add_channel(kB, queue(Priority::kBulk));
  outbox.push(kB, message(1000), now_ms(0));
  drain(outbox);
  auto urgent = queue(Priority::kUrgent);
  urgent.depth = 0;
  outbox.add_channel(kA, urgent);
  for (int i = 0; i < 1000; ++i) outbox.push(kA, message(84), now_ms(0));  // 128 with header
  drain(outbox);
  EXPECT_LE(outbox.unacknowledged_bytes(), 368U + kUrgentReserveBytes);
  EXPECT_EQ(outbox.counts(kA).sent, kUrgentReserveBytes / 128 - 1);  // acks were asked for
  outbox.push_small(AckFrame{1});
  outbox.push_small(TimeRequest{1});
  ASSERT_TRUE(outbox.push_control({"{}"}));
  EXPECT_EQ(drain(outbox), "ack 1 ask\n\"{}\"\n");
}

TEST(OutboxWindow, AFragmentLargerThanTheWindowIsCut) {
  auto options = one_by_one();
  options.fragment_bytes = 65'536;
  options.unacknowledged_bytes_max = 1000;
  Outbox outbox(options);
  outbox.add_channel(kA, {});
  outbox.push(kA, message(2000), now_ms(0));
  EXPECT_EQ(drain(outbox), "1#1:500/2000\n");
  EXPECT_TRUE(outbox.acknowledge({536}, {}));
  EXPECT_EQ(drain(outbox), "1+500\n");
}

TEST(OutboxChannel, ClearedItAbortsWhatIsOpen) {
  Outbox outbox(one_by_one());
  outbox.add_channel(kA, {});
  outbox.push(kA, message(150), now_ms(0));
  outbox.push(kA, message(12), now_ms(0));
  EXPECT_EQ(next(outbox), "1#1:100/150");
  outbox.clear_channel(kA);
  EXPECT_EQ(dropped(outbox, kA, DropReason::kNoDemand), 2U);
  EXPECT_EQ(outbox.data_bytes(), 0U);
  outbox.push(kA, message(13), now_ms(0));
  outbox.clear_channel(kA);  // nothing open: no second abort
  outbox.push(kA, message(14), now_ms(0));
  EXPECT_EQ(drain(outbox), "1!\n1#2:14\n");
}

TEST(OutboxChannel, RemovedItIsSilent) {
  Outbox outbox(one_by_one());
  outbox.add_channel(kA, {});
  outbox.push(kA, message(150), now_ms(0));
  outbox.push(kA, message(12), now_ms(0));
  EXPECT_EQ(next(outbox), "1#1:100/150");
  outbox.clear_channel(kA);  // the abort that waits goes, too: the peer forgets the channel
  outbox.push(kA, message(13), now_ms(0));
  const auto last = outbox.remove_channel(kA);
  expect_balance(last);
  EXPECT_EQ(last.dropped.of(DropReason::kNoDemand), 2U);
  EXPECT_EQ(last.dropped.of(DropReason::kWithdrawn), 1U);
  EXPECT_EQ(last.queued, 0U);
  outbox.push(kA, message(14), now_ms(0));
  EXPECT_EQ(drain(outbox), "");
  EXPECT_EQ(outbox.data_bytes(), 0U);
  EXPECT_EQ(outbox.counts(kA).accepted, 0U);
  outbox.remove_channel(kA);
  outbox.clear_channel(kA);
}

TEST(OutboxChannel, WithoutACodecBothSizesAreTheBodys) {
  Outbox outbox(one_by_one());
  outbox.add_channel(kA, {});
  auto odd = message(12);
  odd.raw_bytes = 99;
  outbox.push(kA, std::move(odd), now_ms(0));
  EXPECT_EQ(drain(outbox), "1#1:12\n");  // the reader would refuse different sizes
}

TEST(OutboxKeep, AChannelThatKeepsDropsNothingAndTakesNobodysRoom) {
  auto tight = one_by_one();
  tight.data_bytes_max = 300;
  Outbox outbox(tight);
  QueueOptions keep;
  keep.keep = true;
  keep.depth = 1;
  keep.queue_bytes_max = 1;
  outbox.add_channel(kA, keep);
  outbox.add_channel(kB, {});
  for (int i = 0; i < 50; ++i) outbox.push(kA, message(100), now_ms(0));
  for (int i = 0; i < 5; ++i) outbox.push(kB, message(100), now_ms(0));
  EXPECT_EQ(outbox.counts(kA).queued, 50U);
  EXPECT_EQ(outbox.counts(kB).queued, 3U);
  EXPECT_EQ(outbox.kept_bytes(), 50 * (100 + kKeptMessageBytes));
  EXPECT_EQ(outbox.data_bytes(), 300U);
  outbox.remove_channel(kA);
  EXPECT_EQ(outbox.kept_bytes(), 0U);
}

TEST(OutboxTracked, AMessageIsDeliveredWhenItsLastByteIsAcknowledged) {
  Outbox outbox(one_by_one());
  outbox.add_channel(kA, {});
  auto tracked = message(150);
  tracked.tracked = true;
  outbox.push(kA, std::move(tracked), now_ms(0));
  outbox.push(kA, message(10), now_ms(0));
  const auto first = outbox.next(now_ms(0)).value().size();
  EXPECT_TRUE(outbox.acknowledge({first}, {}).value().empty());
  auto all = first;
  while (const auto packet = outbox.next(now_ms(0))) all += packet->size();
  const auto delivered = outbox.acknowledge({all}, {}).value();
  ASSERT_EQ(delivered.size(), 1U);
  EXPECT_EQ(delivered[0].channel, kA);
  EXPECT_EQ(delivered[0].subject, OriginId{7});
  EXPECT_TRUE(outbox.acknowledge({all}, {}).value().empty());
}

// After what the link carries in 0.5 s.
TEST(OutboxLimits, OnAThinLinkAVeryLargeMessageSoonLetsOthersHaveATurn) {
  OutboxOptions options = one_by_one();
  options.bytes_per_second_max = 100'000;
  Outbox outbox(options);
  for (const auto channel : {kA, kB}) {
    outbox.add_channel(channel, queue(Priority::kBulk));
    outbox.push(channel, message(100'000), now_ms(0));
  }
  std::size_t in_a_row = 0;
  for (int at = 0; at < 2000; at += 2) {
    const std::string line = next(outbox, now_ms(at));
    if (line.starts_with("2")) break;
    if (line.starts_with("1")) in_a_row += 100;
  }
  EXPECT_GE(in_a_row, 40'000U);
  EXPECT_LE(in_a_row, 60'000U);
}

}  // namespace
}  // namespace connect_bridge::flow_test
