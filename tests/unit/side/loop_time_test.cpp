// Who pays for the loop's time, and whose packet is read next.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

using namespace std::chrono_literals;

// Two identities with a link each.
struct TwoLinks : Script {
  explicit TwoLinks(SideOptions options = server({everything()})) : Script(std::move(options)) {
    graph({topic("/a").pub(1)});
    pass(3000);
    login(1, {}, called("busy"));
    login(2, {}, called("calm"));
    did();
  }
  void arrive(std::uint32_t connection) {
    side.on_arrival({{connection}, false, {}}, flow_test::now_ms(at));
  }
  void spend(Duration cost) { side.spent(cost, flow_test::now_ms(at).steady); }
  std::uint32_t turn() {
    const auto next = side.take_turn(flow_test::now_ms(at));
    return next ? next->connection.value : 0;
  }
};

TEST(LoopTime, APacketIsPaidByItsIdentity) {
  TwoLinks s;
  s.arrive(1);
  EXPECT_EQ(s.turn(), 1U);
  s.say(1, Accepts{});
  s.spend(10ms);
  s.arrive(1);
  s.arrive(2);
  EXPECT_EQ(s.turn(), 2U);
  EXPECT_EQ(s.turn(), 1U);
  EXPECT_EQ(s.turn(), 0U);
}

TEST(LoopTime, SoIsWhatFollowsLater) {
  TwoLinks s;
  s.say(1, Accepts{});
  s.say(1, Offer{{channel(1, "/b", {origin(1, 9)})}, true});
  s.pass(1000);
  bool made = false;
  while (const auto action = s.side.next_action()) {
    if (!std::holds_alternative<CreateMirror>(*action)) continue;
    s.spend(50ms);
    made = true;
  }
  ASSERT_TRUE(made);
  s.arrive(1);
  s.arrive(2);
  EXPECT_EQ(s.turn(), 2U);
}

TEST(LoopTime, SoIsWhatIsSentToIt) {
  TwoLinks s;
  s.say(1, Accepts{});
  while (s.side.next_packet({1}, flow_test::now_ms(s.at))) s.spend(1ms);
  s.arrive(1);
  s.arrive(2);
  EXPECT_EQ(s.turn(), 2U);
}

TEST(LoopTime, SoIsACheckOfItsFindings) {
  TwoLinks s;
  Accepts takes;
  takes.findings = true;
  s.say(1, takes);
  s.give(FindingsMade{{{LinkId{s.status().links.at(0).number}, {{"qos", "/a"}}}}});
  s.spend(50ms);
  s.arrive(1);
  s.arrive(2);
  EXPECT_EQ(s.turn(), 2U);
}

TEST(LoopTime, SoIsTheLossOfItsConnection) {
  TwoLinks s;
  s.say(1, Accepts{});
  s.lose(1);
  s.spend(50ms);
  s.login(3, {}, called("busy"));
  s.arrive(3);
  s.arrive(2);
  EXPECT_EQ(s.turn(), 2U);
}

TEST(LoopTime, SoIsADeadlineOfItsPublisherHere) {
  SideOptions options = server({everything()});
  options.matching = 200ms;
  TwoLinks s(options);
  s.graph({topic("/b").sub(50)});
  s.say(1, Accepts{});
  s.say(1, Offer{{channel(1, "/b", {origin(1, 9)})}, true});
  s.did();
  EXPECT_TRUE(s.said(1).find("demand 1 on") != std::string::npos);
  s.message(1, 1, 1, "first");
  EXPECT_EQ(times(s.did(), "publish "), 0);
  s.pass(300);
  bool published = false;
  while (const auto action = s.side.next_action()) {
    if (!std::holds_alternative<Publish>(*action)) continue;
    s.spend(50ms);
    published = true;
  }
  ASSERT_TRUE(published);
  s.arrive(1);
  s.arrive(2);
  EXPECT_EQ(s.turn(), 2U);
}

TEST(LoopTime, AChangeOfTheGraphHereIsPaidByNobody) {
  TwoLinks s;
  s.say(1, Accepts{});
  s.say(2, Accepts{});
  s.graph({topic("/a").pub(1), topic("/c").pub(2)});
  s.spend(50ms);
  s.arrive(1);
  s.arrive(2);
  EXPECT_EQ(s.turn(), 1U);
}

// What is due for who has used much waits for the packets of the others.
TEST(LoopTime, DueWorkOfWhoUsesMuchComesLater) {
  TwoLinks s;
  s.say(1, Accepts{});
  std::vector<OriginOffer> origins;
  for (std::uint8_t i = 1; i <= 11; ++i)
    origins.push_back(origin(i, static_cast<std::uint8_t>(i + 20)));
  s.say(1, Offer{{channel(1, "/b", origins)}, true});
  const auto made = [&] {
    int mirrors = 0;
    while (const auto action = s.side.next_action())
      mirrors += int(std::holds_alternative<CreateMirror>(*action));
    return mirrors;
  };
  EXPECT_EQ(made(), 8);
  s.say(1, Accepts{});
  s.spend(10ms);
  s.arrive(2);
  s.pass(100);
  EXPECT_EQ(made(), 0);
  EXPECT_EQ(s.turn(), 2U);
  s.pass(100);
  EXPECT_EQ(made(), 3);
}

// So do packets for it, if they are not urgent.
TEST(LoopTime, PacketsForWhoUsesMuchLeaveLater) {
  TwoLinks s;
  s.say(1, Accepts{{{{"/**"}, {}}}, {}});
  s.said(1);
  s.demand(1, 1);
  EXPECT_NE(s.did().find("subscribe 2 /a"), std::string::npos);
  const auto packet = [&] { return s.side.next_packet({1}, flow_test::now_ms(s.at)).has_value(); };
  while (packet()) {
  }
  s.say(1, Accepts{{{{"/**"}, {}}}, {}});
  s.spend(10ms);
  while (packet()) {
  }
  s.arrive(2);
  s.take(2, 1, "small");
  EXPECT_TRUE(packet());
  while (packet()) {
  }
  s.take(2, 1, std::string(5000, 'x'));
  EXPECT_FALSE(packet());
  EXPECT_EQ(s.turn(), 2U);
  while (s.side.take_ready()) {
  }
  s.say(2, Accepts{});
  std::vector<std::uint32_t> ready;
  while (const auto next = s.side.take_ready()) ready.push_back(next->value);
  EXPECT_NE(std::find(ready.begin(), ready.end(), 1U), ready.end());
  EXPECT_TRUE(packet());
  // Not for ever.
  s.arrive(2);
  s.take(2, 1, std::string(5000, 'x'));
  EXPECT_FALSE(packet());
  s.at += 500;
  EXPECT_TRUE(packet());
}

// Each look costs as much as many wait.
TEST(LoopTime, WhileOthersPacketsWaitItIsLookedAtAgainOnceAMillisecond) {
  TwoLinks s;
  s.say(1, Accepts{{{{"/**"}, {}}}, {}});
  s.demand(1, 1);
  s.did();
  while (s.side.next_packet({1}, flow_test::now_ms(s.at))) {
  }
  s.spend(10ms);
  s.arrive(2);
  s.take(2, 1, std::string(5000, 'x'));
  const auto is_ready = [&] {
    bool ready = false;
    while (const auto next = s.side.take_ready()) ready = ready || next->value == 1;
    return ready;
  };
  is_ready();
  EXPECT_FALSE(s.side.next_packet({1}, flow_test::now_ms(s.at)));
  s.say(2, Accepts{});
  EXPECT_FALSE(is_ready());
  s.at += 1;
  s.say(2, Accepts{});
  EXPECT_TRUE(is_ready());
  EXPECT_EQ(s.turn(), 2U);
  s.say(2, Accepts{});
  EXPECT_TRUE(is_ready()) << "no packet waits any more";
}

TEST(LoopTime, WhosePacketWaitsIsNotSilent) {
  TwoLinks s;
  s.arrive(1);
  s.fall_silent(1);
  s.pass(10'000);
  EXPECT_TRUE(s.status().links.front().open);
  s.arrive(2);
  EXPECT_EQ(s.turn(), 1U);
  s.say(1, Accepts{});
  s.pass(10'000);
  const std::string done = s.did();
  EXPECT_NE(done.find("close 1 "), std::string::npos);
  EXPECT_EQ(done.find("close 2 "), std::string::npos);
}

}  // namespace
}  // namespace connect_bridge::side_test
