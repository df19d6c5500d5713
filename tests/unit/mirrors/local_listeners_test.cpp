// What a peer is told of the subscriptions here.
#include "core/mirrors/local_listeners.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "unit/topics/one_link.hpp"

namespace connect_bridge::topics_test {
namespace {

// The peer may publish /cmd_vel and all below /fib.
struct Telling : Actions {
  Telling() { policy = Policy({rule({"/scan"}, {"/cmd_vel", "/fib/**"})}); }

  std::string see(const std::vector<Topic>& topics) {
    graph = picture(topics);
    subject.tell(peer.link);
    return reports();
  }
  // What said() leaves out.
  std::string reports() {
    std::string lines;
    while (const auto packet = peer.link.connection()->next_packet(ms(0))) {
      const Bytes bytes = flow_test::joined(*packet);
      const auto control =
          decode_control({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
      if (packet->text && control) lines += word_of(control.value()) + "\n";
    }
    return lines;
  }

  OneLink peer;
  LocalListeners subject{side};
};

TEST(LocalListeners, WhatIsListenedToAndThePeerMaySend) {
  Telling s;
  EXPECT_EQ(s.see({topic("/cmd_vel").sub(5, qos(), "base"), topic("/scan").sub(6)}),
            "listeners +1/cmd_vel -[]\n");
  EXPECT_EQ(
      s.see({topic("/cmd_vel").sub(5, qos(), "base").sub(7, qos(), "arm"), topic("/scan").sub(6)}),
      "");
  EXPECT_EQ(s.see({topic("/cmd_vel").sub(7, best_effort(), "arm")}), "");
  EXPECT_EQ(s.see({topic("/cmd_vel").pub(8)}), "listeners -[1]\n");
  EXPECT_EQ(s.see({topic("/cmd_vel").sub(5)}), "listeners +2/cmd_vel -[]\n");
}

TEST(LocalListeners, AnActionsTopicsHaveNone) {
  Telling s;
  EXPECT_EQ(s.see({topic("/fib/_action/feedback").sub(5)}), "");
}

TEST(LocalListeners, RulesThatChange) {
  Telling s;
  s.see({topic("/cmd_vel").sub(5), topic("/scan").sub(6)});
  s.policy = Policy({rule({}, {"/scan"})});
  s.subject.tell(s.peer.link);
  EXPECT_EQ(s.reports(), "") << "rules are asked once";
  s.subject.recheck(s.peer.link);
  EXPECT_EQ(s.reports(), "listeners +2/scan -[1]\n");
}

TEST(LocalListeners, ANewConnectionIsToldAll) {
  Telling s;
  s.see({topic("/cmd_vel").sub(5)});
  s.subject.on_link_lost(s.peer.link.id);
  s.peer.lose();
  s.subject.tell(s.peer.link);  // nobody is there
  s.peer.connect();
  s.subject.tell(s.peer.link);
  EXPECT_EQ(s.reports(), "listeners +1/cmd_vel -[]\n");
}

TEST(LocalListeners, NoMoreThanThePeerTakes) {
  std::vector<Topic> crowd;
  for (int i = 0; i < 1100; ++i) crowd.push_back(topic("/fib/t" + std::to_string(i)).sub(5));
  Telling s;
  const std::string lines = s.see(crowd);
  EXPECT_EQ(std::count(lines.begin(), lines.end(), '+'), 1024);
  EXPECT_EQ(std::count(lines.begin(), lines.end(), '\n'), 1024 / kAddedMax);
  s.did();
  EXPECT_NE(s.logged.find("only 1024 topics that are listened to here are reported to "),
            std::string::npos);
}

}  // namespace
}  // namespace connect_bridge::topics_test
