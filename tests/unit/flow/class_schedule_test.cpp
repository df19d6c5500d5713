// Whose turn it is, without an outbox.
#include "core/flow/class_schedule.hpp"

#include <algorithm>
#include <list>
#include <string>

#include "unit/flow/script.hpp"

namespace connect_bridge::flow_test {
namespace {

// Channels are numbered from 1 on; each has something to send until it says otherwise.
struct Scheduled {
  ChannelQueue& add(Priority priority, bool light = false) {
    const ChannelId id{static_cast<std::uint32_t>(queues.size() + 1)};
    ChannelQueue& added = queues.emplace_back(id, queue(priority), bases, together);
    added.set_light(light);
    schedule.add(added);
    return added;
  }
  // "121": the channels of the next so many turns, in each of which 100 bytes are sent.
  std::string turns(int count) {
    std::string line;
    for (; count > 0; --count) {
      line += std::to_string(schedule.front()->id().value);
      schedule.sent(100);
    }
    return line;
  }

  Budget bases;
  Together together;
  std::list<ChannelQueue> queues;
  ClassSchedule schedule;
};

TEST(ClassSchedule, UrgentGoesFirstAndLightBehindIt) {
  Scheduled s;
  s.add(Priority::kBulk);
  s.add(Priority::kHigh);
  s.add(Priority::kBulk, true);
  s.add(Priority::kUrgent);
  std::string order;
  while (const ChannelQueue* queue = s.schedule.front()) {
    order += std::to_string(queue->id().value);
    s.schedule.sent_all(100);
  }
  EXPECT_EQ(order, "4321");
}

TEST(ClassSchedule, UrgentLeavesNothingToTheOthers) {
  Scheduled s;
  s.add(Priority::kHigh);
  s.add(Priority::kUrgent);
  EXPECT_EQ(s.turns(20), std::string(20, '2'));
}

TEST(ClassSchedule, TheOtherClassesShareByWeight) {
  Scheduled s;
  s.add(Priority::kHigh);
  s.add(Priority::kNormal);
  s.add(Priority::kBulk);
  const std::string turns = s.turns(13 * 10);
  EXPECT_EQ(std::count(turns.begin(), turns.end(), '1'), 80);
  EXPECT_EQ(std::count(turns.begin(), turns.end(), '2'), 40);
  EXPECT_EQ(std::count(turns.begin(), turns.end(), '3'), 10);
}

// Not of turns: a class that sends large parts has fewer.
TEST(ClassSchedule, TheWeightsAreOfBytes) {
  Scheduled s;
  s.add(Priority::kHigh);
  s.add(Priority::kNormal);
  std::string turns;
  for (int i = 0; i < 10; ++i) {
    const bool high = s.schedule.front()->id() == kA;
    turns += high ? '1' : '2';
    s.schedule.sent(high ? 800 : 100);
  }
  EXPECT_EQ(turns, "1222212222");
}

TEST(ClassSchedule, ChannelsOfAClassTakeTurns) {
  Scheduled s;
  for (int i = 0; i < 3; ++i) s.add(Priority::kNormal);
  EXPECT_EQ(s.turns(6), "123123");
}

// A queue that has so many bytes to send in one message.
ChannelQueue& add_message(Scheduled& s, std::size_t bytes) {
  const ChannelId id{static_cast<std::uint32_t>(s.queues.size() + 1)};
  ChannelQueue& added = s.queues.emplace_back(id, queue(Priority::kNormal), s.bases, s.together);
  added.push(message(bytes), 1, now_ms(0));
  s.schedule.add(added);
  return added;
}

// Takes parts of at most 100 bytes: the channels in the order of their turns.
std::string parts(Scheduled& s, int count) {
  std::string line;
  for (; count > 0 && !s.schedule.empty(); --count) {
    ChannelQueue& queue = *s.schedule.front();
    line += std::to_string(queue.id().value);
    PacketBuilder packet;
    queue.ready(now_ms(0));
    queue.prepare(0);
    queue.take_part(100, packet, now_ms(0));
    if (queue.empty()) {
      s.schedule.sent_all(100);
    } else {
      s.schedule.sent(100);
    }
  }
  return line;
}

TEST(ClassSchedule, EqualMessagesLeaveOneAfterTheOther) {
  Scheduled s;
  for (int i = 0; i < 3; ++i) add_message(s, 300);
  EXPECT_EQ(parts(s, 9), "111222333");
}

TEST(ClassSchedule, ASmallMessageOvertakesALargeOne) {
  Scheduled s;
  add_message(s, 500);
  EXPECT_EQ(parts(s, 2), "11");
  add_message(s, 200);  // two thirds of what is left of the first
  add_message(s, 400);
  EXPECT_EQ(parts(s, 9), "221113333");
}

// Small messages again and again leave the large one its share.
TEST(ClassSchedule, ALargeMessageIsNotOvertakenForEver) {
  Scheduled s;
  ChannelQueue& large = add_message(s, 500);
  ChannelQueue& small = add_message(s, 100);
  std::string order;
  for (int i = 0; i < 14 && !large.empty(); ++i) {
    order += parts(s, 1);
    if (small.empty()) small.push(message(100), 1, now_ms(0));
    s.schedule.add(small);
  }
  EXPECT_EQ(order, "222211111");
}

// At most turn_bytes at a time: what else is that large has its turn meanwhile.
TEST(ClassSchedule, AVeryLargeMessageDoesNotKeepItsTurn) {
  Scheduled s;
  s.schedule.set_turn_bytes(300);
  add_message(s, 900);
  add_message(s, 600);
  EXPECT_EQ(parts(s, 15), "111222111222111");
}

// What it has not sent is not kept for it.
TEST(ClassSchedule, AChannelThatWasIdleGetsNothingExtra) {
  Scheduled s;
  s.schedule.set_turn_bytes(300);
  add_message(s, 1500);
  EXPECT_EQ(parts(s, 9), "111111111");
  add_message(s, 900);
  EXPECT_EQ(parts(s, 12), "111222111222");
}

// Nor where nobody else had anything to send when it came.
TEST(ClassSchedule, AChannelThatComesFirstGetsNothingExtra) {
  Scheduled s;
  ChannelQueue& first = add_message(s, 500);
  EXPECT_EQ(parts(s, 5), "11111");
  first.push(message(500), 1, now_ms(0));
  s.schedule.add(first);
  EXPECT_EQ(parts(s, 5), "11111");
  ChannelQueue& second = add_message(s, 300);
  for (int i = 0; i < 3; ++i) second.push(message(300), 1, now_ms(0));
  first.push(message(300), 1, now_ms(0));
  s.schedule.add(first);
  EXPECT_EQ(parts(s, 15), "222222111222222");
}

// What it has sent as light does not count where it is not.
TEST(ClassSchedule, AnotherClassHasAnotherClock) {
  Scheduled s;
  ChannelQueue& light = s.add(Priority::kNormal, true);
  s.turns(100);
  s.schedule.leave_class(light);
  light.set_light(false);
  light.push(message(300), 1, now_ms(0));
  s.schedule.add(light);
  add_message(s, 500);
  EXPECT_EQ(parts(s, 8), "11122222");
}

TEST(ClassSchedule, AClassThatWasIdleGetsNothingExtra) {
  Scheduled s;
  s.add(Priority::kHigh);
  EXPECT_EQ(s.turns(10), "1111111111");
  s.add(Priority::kBulk);
  EXPECT_EQ(s.turns(9), "211111111");
}

TEST(ClassSchedule, AChannelWithNothingToSendHasNoTurnUntilItIsAddedAgain) {
  Scheduled s;
  ChannelQueue& first = s.add(Priority::kNormal);
  s.add(Priority::kNormal);
  s.schedule.sent_all(100);
  EXPECT_EQ(s.turns(2), "22");
  s.schedule.add(first);
  EXPECT_EQ(s.turns(4), "2121");
}

TEST(ClassSchedule, AChannelIsInItOnce) {
  Scheduled s;
  ChannelQueue& queue = s.add(Priority::kNormal);
  s.schedule.add(queue);
  EXPECT_EQ(s.schedule.queues(Priority::kNormal).size(), 1U);
  s.schedule.remove(queue);
  EXPECT_TRUE(s.schedule.empty());
}

// It goes on after a break: what it has kept leaves message by message.
TEST(ClassSchedule, AChannelThatRestsHasNoTurnBeforeItsTime) {
  Scheduled s;
  ChannelQueue& resting = s.add(Priority::kHigh);
  OutMessage kept = message(100);
  kept.resumes = true;
  std::uint64_t arrivals = 0;
  resting.go_on({kept, kept}, arrivals, now_ms(0), now_ms(1000).steady);
  s.add(Priority::kBulk);
  PacketBuilder packet;
  resting.take_part(1000, packet, now_ms(0));
  const auto until = resting.rests_until();
  ASSERT_TRUE(until);
  s.schedule.sent(100);
  EXPECT_EQ(s.turns(2), "22");
  EXPECT_EQ(s.schedule.wakes_at(), until);
  s.schedule.wake(*until - std::chrono::nanoseconds(1));
  EXPECT_EQ(s.turns(1), "2");
  s.schedule.wake(*until);
  EXPECT_EQ(s.schedule.front(), &resting);
  EXPECT_FALSE(s.schedule.wakes_at());
}

}  // namespace
}  // namespace connect_bridge::flow_test
