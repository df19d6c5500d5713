// A real server is given no more requests than its queue keeps; the others stand in line.
#include <gtest/gtest.h>

#include "unit/services/calls_script.hpp"

namespace connect_bridge::side_test {
namespace {

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

TEST(LocalServicesLine, RulesThatChangeOpenTheQueue) {
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

TEST(LocalServicesLine, ResultsAreAskedForInDueTime) {
  Rule acting = callable();
  acting.opens[Direction::kExport][OpenedBy::kActions] = {Pattern::parse("/**").value()};
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

}  // namespace
}  // namespace connect_bridge::side_test
