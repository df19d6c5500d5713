// Goals of a peer that is gone: `cancel_after`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "core/base/cdr.hpp"
#include "core/services/sent_goals.hpp"
#include "unit/services/calls_script.hpp"
#include "unit/side/action.hpp"

namespace connect_bridge::side_test {
namespace {

using std::chrono::seconds;
using testing::HasSubstr;

Payload with_id(std::uint8_t n) {
  Bytes bytes{0, 1, 0, 0};
  bytes.insert(bytes.end(), 16, n);
  return Payload::adopt(std::move(bytes));
}
Payload answer_of(std::uint8_t first) {
  return Payload::adopt(Bytes{0, 1, 0, 0, first, 0, 0, 0});
}

// Its return code, and the number of goals that it cancels.
Payload cancels(std::uint8_t code, std::uint32_t goals) {
  return CdrWriter().u8(code).u32(goals).take();
}

// The side offers the parts of /fib in the order of their names.
constexpr std::uint32_t kResults = 4;
constexpr std::uint32_t kGoals = 5;

// A robot with the action /fib, and anna, who may send goals, on link 1.
struct Acted : Script {
  explicit Acted(Duration cancel_after = seconds(5)) : Script(options(cancel_after)) {
    serve_action(*this);
    session = login(1, {}, Identity{"anna", {}, 0, "token:1"});
    begin(1);
  }
  static SideOptions options(Duration cancel_after) {
    Rule rule = acting();
    rule.treatment.cancel_after = cancel_after;
    SideOptions result = server({rule});
    result.resume_for = seconds(60);
    result.audits = true;
    return result;
  }
  void begin(std::uint32_t connection) {
    say(connection, Accepts{{{{"/**"}, {}, {"/**"}, {"/**"}, {"/**"}}}, {}});
    EXPECT_THAT(said(connection), HasSubstr("offer"));
    calls();
  }
  std::string calls() {
    std::string lines;
    while (const auto action = side.next_action()) {
      if (const auto* log = std::get_if<Log>(&*action)) logged += log->text + "\n";
      if (const auto* line = std::get_if<Audit>(&*action)) noted += word_of(*line) + "\n";
      if (const auto* made = std::get_if<CreateServiceClient>(&*action)) {
        lines += "client " + made->service + "\n";
        client = made->id;
      }
      if (std::holds_alternative<DestroyServiceClient>(*action)) lines += "no client\n";
      if (const auto* sent = std::get_if<SendRequest>(&*action)) {
        last = sent->invocation;
        request = {sent->payload.view().begin(), sent->payload.view().end()};
        lines += "request of " + std::to_string(request.size()) + "\n";
      }
    }
    return lines;
  }
  void attach(std::uint32_t connection, std::uint32_t channel, std::uint32_t requests) {
    say(connection, Attach{{channel}, {requests}});
    calls();
    give(ServiceReady{client, true, "hash"});
    calls();
    said(connection);
  }
  // The goals' requests are on channel 1 of the peer.
  void send_goal(std::uint32_t connection, std::uint8_t id, bool accepted = true) {
    if (!std::exchange(attached, true)) attach(connection, kGoals, 1);
    goals = goals ? goals : client;
    ask(connection, 1, ++asked, with_id(id));
    calls();
    give(ResponseTaken{goals, last, answer_of(accepted ? 1 : 0)});
    calls();
  }
  void ask(std::uint32_t connection, std::uint32_t requests, std::uint32_t number,
           const Payload& body) {
    message(connection, requests, number, body, Codec::kNone,
            static_cast<std::uint32_t>(body.size()));
  }

  Token128 session;
  ServiceClientId client;
  ServiceClientId goals;
  InvocationId last;
  Bytes request;
  bool attached = false;
  std::uint32_t asked = 0;
};

TEST(SentGoals, AGoalOfALostLinkIsCancelledByItsId) {
  Acted s;
  s.send_goal(1, 7);
  s.lose(1);
  s.pass(4999);
  EXPECT_EQ(s.calls().find("request"), std::string::npos);
  s.noted.clear();
  s.pass(1);
  EXPECT_EQ(s.calls(), "client /fib/_action/cancel_goal\n");
  EXPECT_THAT(s.logged, HasSubstr("asks to cancel a goal of anna at /fib"));
  s.give(ServiceReady{s.client, true, "hash"});
  EXPECT_EQ(s.calls(), "request of 28\n");
  EXPECT_EQ(s.request[4], 7);
  EXPECT_EQ(s.noted, "");
  s.give(ResponseTaken{s.client, s.last, cancels(0, 1)});
  EXPECT_EQ(s.calls(), "no client\n");
  EXPECT_EQ(s.noted,
            "goal_cancelled 1 anna export /fib by rule link_lost: goal "
            "07070707070707070707070707070707\n");
}

// It has ended and nobody has asked for its result, or its server goes on.
TEST(SentGoals, AGoalThatItsServerDoesNotCancelIsNotInTheAuditLog) {
  for (const Payload& answer : {cancels(0, 0), cancels(1, 0), cancels(3, 0), answer_of(0)}) {
    Acted s;
    s.send_goal(1, 7);
    s.lose(1);
    s.pass(5000);
    s.calls();
    s.noted.clear();
    s.give(ServiceReady{s.client, true, "hash"});
    EXPECT_EQ(s.calls(), "request of 28\n");
    s.give(ResponseTaken{s.client, s.last, answer});
    EXPECT_EQ(s.calls(), "no client\n");
    EXPECT_EQ(s.noted, "");
    EXPECT_THAT(s.logged, HasSubstr("a goal of anna at /fib is not cancelled: it has ended"));
  }
}

TEST(SentGoals, AClientThatNobodyAnswersStaysUntilItsServerGoes) {
  Acted s;
  s.send_goal(1, 7);
  s.lose(1);
  s.pass(5000);
  s.calls();
  s.give(ServiceReady{s.client, true, "hash"});
  EXPECT_EQ(s.calls(), "request of 28\n");
  s.graph({});
  EXPECT_EQ(s.calls(), "no client\n");
}

TEST(SentGoals, TheLinkThatReturnsInTimeKeepsItsGoal) {
  Acted s;
  s.send_goal(1, 7);
  s.lose(1);
  s.pass(4000);
  s.login(2, s.session, Identity{"anna", {}, 0, "token:1"});
  s.begin(2);
  s.calls();
  s.pass(10'000);
  EXPECT_EQ(s.calls(), "");
}

TEST(SentGoals, ARefusedGoalAndOneWithAResultAreNotCancelled) {
  Acted s;
  s.send_goal(1, 7, false);
  s.send_goal(1, 8);
  s.attach(1, kResults, 2);
  s.ask(1, 2, 1, with_id(8));
  EXPECT_EQ(s.calls(), "request of 20\n");
  s.give(ResponseTaken{s.client, s.last, answer_of(4)});
  s.lose(1);
  s.pass(10'000);
  EXPECT_EQ(s.calls().find("cancel_goal"), std::string::npos);
}

TEST(SentGoals, WithoutCancelAfterGoalsGoOn) {
  Acted s(kForever);
  s.send_goal(1, 7);
  s.lose(1);
  s.pass(600'000);
  EXPECT_EQ(s.calls().find("cancel_goal"), std::string::npos);
}

// ---- the table alone

GoalSender sender(std::uint32_t link, std::uint32_t process = 7) {
  return {{link}, "anna", Script::peer_id(process), "anna"};
}
SentGoal goal(std::uint32_t link, std::uint8_t id, std::uint32_t sent,
              Duration after = seconds(5)) {
  SentGoal result{"/fib", {}, sender(link), {sent}, after};
  result.id.fill(id);
  return result;
}
TimePoint at(int s) {
  return TimePoint{} + seconds(s);
}
std::vector<int> ids_of(const std::vector<SentGoal>& goals) {
  std::vector<int> ids;
  for (const SentGoal& goal : goals) ids.push_back(goal.id[0]);
  return ids;
}

TEST(SentGoals, OnlyGoalsOfTheLostLinkEnd) {
  SentGoals goals;
  goals.add(goal(1, 1, 11));
  goals.add(goal(1, 2, 12, seconds(9)));
  goals.add(goal(2, 3, 13));
  EXPECT_EQ(goals.deadline(), std::nullopt);
  goals.on_link_lost({1}, at(10));
  goals.on_link_lost({1}, at(13));  // it is dead
  EXPECT_EQ(goals.deadline(), at(15));
  EXPECT_EQ(ids_of(goals.take_due(at(14))), (std::vector<int>{}));
  EXPECT_EQ(ids_of(goals.take_due(at(15))), (std::vector<int>{1}));
  EXPECT_EQ(goals.deadline(), at(19));
  EXPECT_EQ(ids_of(goals.take_due(at(100))), (std::vector<int>{2}));
  EXPECT_EQ(goals.deadline(), std::nullopt);
}

TEST(SentGoals, AGoalThatHasEndedIsNotCancelled) {
  SentGoals goals;
  for (std::uint8_t id = 1; id <= 4; ++id) goals.add(goal(1, id, 10U + id));
  goals.on_asked("/fib", with_id(2).view(), {22});
  goals.on_asked("/other", with_id(3).view(), {23});
  goals.on_ended({11});  // refused
  goals.on_ended({22});
  goals.on_ended({23});
  goals.on_link_lost({1}, at(0));
  EXPECT_EQ(ids_of(goals.take_due(at(5))), (std::vector<int>{3, 4}));
}

// Its request waited for its turn at the server.
TEST(SentGoals, AGoalThatReachesItsServerAfterTheLossEndsWithTheOthers) {
  SentGoals goals;
  goals.on_link_lost({1}, at(10));
  goals.add(goal(1, 1, 11));
  goals.add(goal(2, 2, 12));
  EXPECT_EQ(goals.deadline(), at(15));
  EXPECT_EQ(ids_of(goals.take_due(at(15))), (std::vector<int>{1}));
  goals.on_link_open(sender(1));
  goals.add(goal(1, 3, 13));
  EXPECT_EQ(goals.deadline(), std::nullopt);
  goals.on_link_dead({1}, at(20));
  EXPECT_EQ(goals.deadline(), at(25));
}

TEST(SentGoals, AProcessThatReturnsKeepsItsGoals) {
  SentGoals goals;
  goals.add(goal(1, 1, 11));
  goals.on_link_lost({1}, at(0));
  goals.on_link_open(sender(2));
  EXPECT_EQ(goals.deadline(), std::nullopt);
  goals.on_link_lost({1}, at(5));
  EXPECT_EQ(goals.deadline(), std::nullopt);
  goals.on_link_lost({2}, at(10));
  goals.on_link_open(sender(2, 8));  // it was started again
  GoalSender other = sender(2);
  other.identity = "bob";
  goals.on_link_open(other);
  EXPECT_EQ(ids_of(goals.take_due(at(15))), (std::vector<int>{1}));
}

TEST(SentGoals, AServerThatIsGoneHasNoGoals) {
  SentGoals goals;
  goals.add(goal(1, 1, 11));
  goals.on_server_gone("/fib");
  goals.on_link_lost({1}, at(0));
  EXPECT_EQ(goals.deadline(), std::nullopt);
}

TEST(SentGoals, TheOldestOfALinkIsForgottenAtTheLimit) {
  SentGoals goals;
  goals.add(goal(2, 200, 1));
  for (std::uint32_t n = 0; n <= SentGoals::kGoalsMax; ++n) {
    SentGoal next = goal(1, n == 0 ? 99 : 1, 100 + n);
    next.id[1] = static_cast<std::uint8_t>(n);
    goals.add(std::move(next));
  }
  goals.on_link_lost({1}, at(0));
  const auto due = goals.take_due(at(5));
  EXPECT_EQ(due.size(), SentGoals::kGoalsMax);
  EXPECT_EQ(due.front().id[0], 1);
  goals.on_link_lost({2}, at(0));
  EXPECT_EQ(ids_of(goals.take_due(at(5))), (std::vector<int>{200}));
}

// Its server refuses a second goal of this id.
TEST(SentGoals, AGoalStaysWithWhoHasSentItFirst) {
  SentGoals goals;
  goals.add(goal(1, 7, 11));
  goals.add(goal(2, 7, 12));
  goals.on_link_lost({2}, at(0));
  EXPECT_EQ(ids_of(goals.take_due(at(5))), (std::vector<int>{}));
}

TEST(SentGoals, LinksTogetherHaveALimit) {
  SentGoals goals;
  for (std::uint32_t n = 0; n <= SentGoals::kAllMax; ++n) {
    SentGoal next = goal(n + 1, 0, 100 + n);
    next.id[0] = static_cast<std::uint8_t>(n);
    next.id[1] = static_cast<std::uint8_t>(n >> 8U);
    goals.add(std::move(next));
  }
  goals.on_link_lost({1}, at(0));
  EXPECT_EQ(goals.deadline(), std::nullopt);
  goals.on_link_lost({2}, at(0));
  EXPECT_EQ(goals.deadline(), at(5));
}

// Many links do not help an identity: its own goals are forgotten.
TEST(SentGoals, NoIdentityPushesOutAnothersGoals) {
  SentGoals goals;
  goals.add(goal(1, 200, 1));
  for (std::uint32_t n = 0; n <= SentGoals::kAllMax; ++n) {
    SentGoal next = goal(2 + n / 100, 0, 100 + n);
    next.sender.identity = "busy";
    next.id[1] = static_cast<std::uint8_t>(n);
    next.id[2] = static_cast<std::uint8_t>(n >> 8U);
    goals.add(std::move(next));
  }
  goals.on_link_lost({1}, at(0));
  EXPECT_EQ(ids_of(goals.take_due(at(5))), (std::vector<int>{200}));
  goals.on_link_lost({2}, at(10));
  EXPECT_EQ(goals.take_due(at(15)).size(), 98U);  // the two oldest of link 2 are forgotten
}

TEST(SentGoals, ARequestToCancelNamesOneGoal) {
  const Payload request = cancel_request(goal(1, 9, 1).id);
  Bytes expected{0, 1, 0, 0};
  expected.insert(expected.end(), 16, 9);
  expected.insert(expected.end(), 8, 0);
  EXPECT_EQ(Bytes(request.view().begin(), request.view().end()), expected);
  EXPECT_EQ(goal_in(request.view()), goal(1, 9, 1).id);
  EXPECT_EQ(goal_in(with_id(1).view().first(19)), std::nullopt);
}

}  // namespace
}  // namespace connect_bridge::side_test
