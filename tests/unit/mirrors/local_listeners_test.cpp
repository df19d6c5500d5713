// What a peer is told of the subscriptions here.
#include "core/mirrors/local_listeners.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "unit/topics/one_link.hpp"

namespace connect_bridge::topics_test {
namespace {

// The peer may publish /cmd_vel and all below /fib.
struct Telling : Actions {
  Telling() {
    policy = Policy({rule({"/scan"}, {"/cmd_vel", "/fib/**"})});
    subject.begin_step();
    subject.begin(peer.link, ms(0));
  }

  // A step in which the graph changes.
  void change(const std::vector<Topic>& topics) {
    const GraphView before = std::exchange(graph, picture(topics));
    subject.begin_step();
    subject.on_graph(graph.since(before), ms(0));
  }
  std::string see(const std::vector<Topic>& topics) {
    change(topics);
    return reports(peer);
  }
  // A step for what is left.
  std::string go_on(OneLink& of) {
    subject.begin_step();
    subject.on_time(ms(0));
    return reports(of);
  }
  // What said() leaves out.
  static std::string reports(OneLink& of) {
    std::string lines;
    while (const auto packet = of.link.connection()->next_packet(ms(0))) {
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
  s.subject.begin_step();
  s.subject.recheck(s.peer.link);
  EXPECT_EQ(Telling::reports(s.peer), "listeners -[1]\n");
  s.subject.go_on(ms(0));
  EXPECT_EQ(Telling::reports(s.peer), "listeners +2/scan -[]\n");
}

TEST(LocalListeners, ANewConnectionIsToldAll) {
  Telling s;
  s.see({topic("/cmd_vel").sub(5)});
  s.subject.on_link_lost(s.peer.link.id);
  s.peer.lose();
  s.subject.begin_step();
  s.subject.go_on(ms(0));  // nobody is there
  s.peer.connect();
  s.subject.begin(s.peer.link, ms(0));
  EXPECT_EQ(Telling::reports(s.peer), "listeners +1/cmd_vel -[]\n");
}

// Two topics are more than one step reports.
struct Counted : Telling {
  Counted() { names.listeners_at_once = 1; }
};

TEST(LocalListeners, AStepReportsSoManyAndTheNextOneGoesOn) {
  Counted s;
  EXPECT_EQ(s.see({topic("/fib/a").sub(5), topic("/fib/b").sub(5), topic("/fib/c").sub(5)}),
            "listeners +1/fib/a -[]\n");
  EXPECT_TRUE(s.subject.deadline());
  EXPECT_EQ(s.go_on(s.peer), "listeners +2/fib/b -[]\n");
  EXPECT_EQ(s.go_on(s.peer), "listeners +3/fib/c -[]\n");
  EXPECT_EQ(s.go_on(s.peer), "");
  EXPECT_FALSE(s.subject.deadline());
  EXPECT_EQ(s.see({}), "listeners -[1]\n");
  EXPECT_EQ(s.go_on(s.peer), "listeners -[2]\n");
  EXPECT_EQ(s.go_on(s.peer), "listeners -[3]\n");
  EXPECT_FALSE(s.subject.deadline());
}

// Before its turn.
TEST(LocalListeners, WhatEndsMeanwhileIsNotReported) {
  Counted s;
  s.see({topic("/fib/a").sub(5), topic("/fib/b").sub(5), topic("/fib/c").sub(5)});
  EXPECT_EQ(s.see({topic("/fib/a").sub(5), topic("/fib/c").sub(5)}), "listeners +2/fib/c -[]\n");
  EXPECT_EQ(s.go_on(s.peer), "");
  EXPECT_FALSE(s.subject.deadline());
}

TEST(LocalListeners, ALinkThatIsToldAllMissesNothingThatChangesMeanwhile) {
  Counted s;
  s.graph = picture({topic("/fib/b").sub(5), topic("/fib/c").sub(5)});
  OneLink late(2);
  s.subject.begin_step();
  s.subject.begin(late.link, ms(0));
  EXPECT_EQ(Telling::reports(late), "listeners +1/fib/b -[]\n");
  s.change({topic("/fib/a").sub(5), topic("/fib/c").sub(5)});
  std::string lines = Telling::reports(late);
  for (int step = 0; step < 9; ++step) lines += s.go_on(late);
  EXPECT_NE(lines.find("/fib/a"), std::string::npos) << lines;
  EXPECT_NE(lines.find("/fib/c"), std::string::npos) << lines;
  EXPECT_NE(lines.find("-[1]"), std::string::npos) << lines;
  EXPECT_FALSE(s.subject.deadline());
}

TEST(LocalListeners, LinksTakeTurns) {
  Counted s;
  OneLink other(2);
  s.subject.begin(other.link, ms(0));
  s.subject.go_on(ms(0));
  EXPECT_EQ(s.see({topic("/fib/a").sub(5), topic("/fib/b").sub(5)}), "listeners +1/fib/a -[]\n");
  EXPECT_EQ(s.go_on(other), "listeners +1/fib/a -[]\n");
  EXPECT_EQ(s.go_on(s.peer), "listeners +2/fib/b -[]\n");
}

TEST(LocalListeners, NoMoreThanThePeerTakes) {
  std::vector<Topic> crowd;
  for (int i = 0; i < 1100; ++i) crowd.push_back(topic("/fib/t" + std::to_string(i)).sub(5));
  Telling s;
  const std::string lines = s.see(crowd);
  EXPECT_EQ(std::count(lines.begin(), lines.end(), '+'), 1024);
  EXPECT_EQ(std::count(lines.begin(), lines.end(), '\n'), 1024 / kAddedMax);
  EXPECT_EQ(s.go_on(s.peer), "");
  s.did();
  EXPECT_NE(s.logged.find("only 1024 topics that are listened to here are reported to "),
            std::string::npos);
}

TEST(LocalListeners, APlaceThatIsFreeIsForThoseThatFoundNone) {
  std::vector<Topic> crowd;
  for (int i = 0; i < 1025; ++i) crowd.push_back(topic("/fib/t" + std::to_string(1000 + i)).sub(5));
  Telling s;
  s.see(crowd);
  std::string lines = s.see({crowd.begin() + 1, crowd.end()});
  lines += s.go_on(s.peer);
  EXPECT_NE(lines.find("-[1]"), std::string::npos) << lines;
  EXPECT_NE(lines.find("+1025/fib/t2024"), std::string::npos) << lines;
}

}  // namespace
}  // namespace connect_bridge::topics_test
