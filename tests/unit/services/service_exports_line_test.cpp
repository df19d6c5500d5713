// A real server is given no more requests than its queue keeps; the others stand in line.
#include <gtest/gtest.h>

#include "unit/services/calls_script.hpp"

namespace connect_bridge::side_test {
namespace {

// The peers on connections 1 and 2 are attached.
void both_attached(Script& s) {
  attached(s);
  s.join(2);
  s.say(2, Attach{{1}, {1}});
}

// Calls `from` to `to` of the peer on a connection.
void call(Script& s, std::uint32_t connection, std::uint32_t from, std::uint32_t to) {
  for (std::uint32_t id = from; id <= to; ++id)
    s.message(connection, 1, id, std::to_string(connection) + "/" + std::to_string(id));
}

// "1/4 2/1": the requests that were handed over since the last call.
std::string handed_over(Script& s) {
  std::string all = s.did(), found;
  for (std::size_t at = all.find("invoke "); at != std::string::npos;
       at = all.find("invoke ", at + 1)) {
    const std::size_t begin = all.find(' ', at + 7) + 1;
    found += (found.empty() ? "" : " ") + all.substr(begin, all.find('\n', begin) - begin);
  }
  return found;
}

TEST(ServiceExportsLine, AServerIsGivenWhatItsQueueKeeps) {
  Script s(server({callable()}));
  attached(s);
  call(s, 1, 1, 30);
  EXPECT_EQ(handed_over(s), "1/1 1/2 1/3 1/4 1/5 1/6 1/7 1/8 1/9 1/10");
  EXPECT_EQ(first(s).waiting, 20U);
  EXPECT_EQ(first(s).pending, 30U);
  answer(s, 1, "a");
  EXPECT_EQ(handed_over(s), "1/11");
  answer(s, 4, "a");  // 2 and 3 are taken, too
  EXPECT_EQ(handed_over(s), "1/12 1/13 1/14");
  answer(s, 3, "a");
  EXPECT_EQ(handed_over(s), "");
  answer(s, 14, "a");
  EXPECT_EQ(handed_over(s), "1/15 1/16 1/17 1/18 1/19 1/20 1/21 1/22 1/23 1/24");
}

TEST(ServiceExportsLine, RulesThatChangeOpenTheQueue) {
  Rule open = callable();
  Script s(server({open}));
  attached(s);
  call(s, 1, 1, 14);
  handed_over(s);
  open.treatment.server_queue = 12;
  s.give(PolicyChanged{Policy({open})});
  EXPECT_EQ(handed_over(s), "1/11 1/12");
  open.treatment.server_queue = 0;
  s.give(PolicyChanged{Policy({open})});
  EXPECT_EQ(handed_over(s), "1/13 1/14");
}

TEST(ServiceExportsLine, WhatNobodyWaitsForAnyLongerLiesInTheQueueAllTheSame) {
  Script s(server({callable()}));
  attached(s);
  call(s, 1, 1, 12);
  handed_over(s);
  s.say(1, Forget{{1}, {{1}, {2}, {3}}});
  EXPECT_EQ(s.did(), "drop_invocation 1.1\ndrop_invocation 1.2\ndrop_invocation 1.3\n");
  s.give(ResponseTaken{{1}, {1}, {}});
  EXPECT_EQ(handed_over(s), "1/11");
  s.give(ResponseTaken{{1}, {2}, {}});
  EXPECT_EQ(handed_over(s), "1/12");
  EXPECT_EQ(s.said(1), "");
}

TEST(ServiceExportsLine, ResultsAreAskedForInDueTime) {
  Rule acting = callable();
  acting.export_actions = {Pattern::parse("/**").value()};
  Script s(server({acting}));
  const auto typed = [](auto state, const std::string& type) {
    state.type = type;
    return state;
  };
  s.graph({typed(topic("/fib/_action/feedback").pub(1), "p/action/Fib_FeedbackMessage"),
           typed(topic("/fib/_action/status").pub(2), "action_msgs/msg/GoalStatusArray")},
          {typed(service("/fib/_action/send_goal"), "p/action/Fib_SendGoal"),
           typed(service("/fib/_action/cancel_goal"), "action_msgs/srv/CancelGoal"),
           typed(service("/fib/_action/get_result"), "p/action/Fib_GetResult")});
  s.login(1);
  s.say(1, Accepts{{{{"/**"}, {}, {"/**"}, {"/**"}, {"/**"}}}, {}});
  const std::string offers = s.said(1);
  ASSERT_NE(offers.find(" 4/fib/_action/get_result"), std::string::npos) << offers;
  s.say(1, Attach{{4}, {1}});
  s.give(ServiceReady{{1}, true, ""});
  call(s, 1, 1, 25);
  EXPECT_EQ(handed_over(s), "1/1 1/2 1/3 1/4 1/5 1/6 1/7 1/8 1/9 1/10");
  s.pass(999);
  EXPECT_EQ(handed_over(s), "");
  s.pass(1);
  EXPECT_EQ(handed_over(s), "1/11 1/12 1/13 1/14 1/15 1/16 1/17 1/18 1/19 1/20");
  answer(s, 2, "a");  // its goal has ended
  EXPECT_EQ(handed_over(s), "");
  answer(s, 20, "a");
  EXPECT_EQ(handed_over(s), "1/21 1/22 1/23 1/24 1/25");
}

TEST(ServiceExportsLine, WhatIsDecompressedHasItsRoomInTheQueue) {
  auto options = server({callable()});
  options.compress_job_bytes = 1000;
  Script s(options);
  both_attached(s);
  s.compressed(2, 1, 1, std::string(2000, 'b'));
  EXPECT_EQ(s.did(), "decompress 1\n");
  call(s, 1, 1, 12);
  EXPECT_EQ(handed_over(s), "1/1 1/2 1/3 1/4 1/5 1/6 1/7 1/8 1/9");
  s.give(JobDone{{1}, sample("2/1")});
  EXPECT_EQ(handed_over(s), "2/1");
  answer(s, 9, "a");
  EXPECT_EQ(handed_over(s), "1/10 1/11 1/12");
  s.compressed(2, 1, 2, std::string(2000, 'b'));
  s.did();
  call(s, 1, 13, 20);
  handed_over(s);
  s.give(JobDone{{2}, {}});  // it was none: the room is another's
  EXPECT_EQ(handed_over(s), "1/18");
}

TEST(ServiceExportsLine, AReleasedClientTakesTheLineWithIt) {
  Script s(server({callable()}));
  attached(s);
  call(s, 1, 1, 20);
  handed_over(s);
  s.say(1, Withdraw{{{1}}});
  const std::string did = s.did();
  EXPECT_EQ(did.find("invoke 1."), std::string::npos) << did;
  EXPECT_NE(did.find("uncall_service 1\n"), std::string::npos) << did;
  EXPECT_EQ(s.status().memory_bytes, 0U);
  s.pass(6000);
  EXPECT_EQ(s.did(), "");
  s.say(1, Attach{{1}, {2}});
  s.give(ServiceReady{{2}, true, ""});
  for (std::uint32_t id = 21; id <= 31; ++id) s.message(1, 2, id, std::to_string(id));
  EXPECT_EQ(handed_over(s), "21 22 23 24 25 26 27 28 29 30");
}

}  // namespace
}  // namespace connect_bridge::side_test
