// What a side reports about the subscriptions in its graph.
#include <gtest/gtest.h>

#include <algorithm>

#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

// The listeners sent to the peer, without other messages.
std::string reports(Script& s, std::uint32_t connection = 1) {
  std::string lines;
  while (const auto packet = s.side.next_packet({connection}, flow_test::now_ms(s.at))) {
    const Bytes bytes = flow_test::joined(*packet);
    if (!packet->text) continue;
    const auto control =
        decode_control({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    if (control && std::holds_alternative<Listeners>(control.value()))
      lines += word_of(control.value()) + "\n";
  }
  return lines;
}

struct ToldListenersTest : testing::Test {
  ToldListenersTest() { s.join(1); }

  Script s{server({rule({"/scan"}, {"/cmd_vel", "/fib/**"})})};
};

TEST_F(ToldListenersTest, WhatIsListenedToAndThePeerMaySend) {
  s.graph({topic("/cmd_vel").sub(5, qos(), "base"), topic("/scan").sub(6)});
  EXPECT_EQ(reports(s), "listeners +1/cmd_vel -[]\n");
  s.graph({topic("/cmd_vel").sub(5, qos(), "base").sub(7, qos(), "arm"), topic("/scan").sub(6)});
  EXPECT_EQ(reports(s), "");
  s.graph({topic("/cmd_vel").sub(7, best_effort(), "arm")});
  EXPECT_EQ(reports(s), "");
  s.graph({topic("/scan").sub(6)});
  EXPECT_EQ(reports(s), "listeners -[1]\n");
}

TEST_F(ToldListenersTest, WhatABridgeSubscribesToIsNoListener) {
  s.graph({topic(kClaimsTopic).pub(9, latched(), "other_bridge"),
           topic("/cmd_vel").sub(5, qos(), "other_bridge")});
  EXPECT_EQ(reports(s), "");
}

TEST_F(ToldListenersTest, AnActionsTopicsHaveNone) {
  s.graph({topic("/fib/_action/feedback").sub(5)});
  EXPECT_EQ(reports(s), "");
}

TEST_F(ToldListenersTest, RulesThatChange) {
  s.graph({topic("/cmd_vel").sub(5, qos(), "base"), topic("/scan").sub(6, qos(), "slam")});
  reports(s);
  s.give(PolicyChanged{Policy({rule({}, {"/scan"})})});
  EXPECT_EQ(reports(s), "listeners +2/scan -[1]\n");
}

TEST_F(ToldListenersTest, ANewConnectionIsToldAll) {
  s.graph({topic("/cmd_vel").sub(5, qos(), "base")});
  reports(s);
  s.lose(1);
  s.login(2);
  EXPECT_EQ(reports(s, 2), "listeners +1/cmd_vel -[]\n");
}

TEST_F(ToldListenersTest, NoMoreThanThePeerTakes) {
  std::vector<Topic> crowd;
  for (int i = 0; i < 1100; ++i) crowd.push_back(topic("/fib/t" + std::to_string(i)).sub(5));
  s.graph(crowd);
  const std::string lines = reports(s);
  EXPECT_EQ(std::count(lines.begin(), lines.end(), '+'), 1024);
  EXPECT_EQ(std::count(lines.begin(), lines.end(), '\n'), 1024 / kAddedMax);
  s.did();
  EXPECT_NE(s.logged.find("only 1024 topics that are listened to here are reported to "),
            std::string::npos);
}

}  // namespace
}  // namespace connect_bridge::side_test
