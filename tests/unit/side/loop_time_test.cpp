// Who pays for the loop's time, and whose packet is read next.
#include <gtest/gtest.h>

#include <variant>

#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

using namespace std::chrono_literals;

// Two identities with a link each.
struct TwoLinks : Script {
  TwoLinks() : Script(server({everything()})) {
    graph({topic("/a").pub(1)});
    pass(3000);
    login(1, {}, called("busy"));
    login(2, {}, called("calm"));
    did();
  }
  void arrive(std::uint32_t connection) { side.on_arrival({connection}, flow_test::now_ms(at)); }
  void spend(Duration cost) { side.spent(cost, flow_test::now_ms(at).steady); }
  std::uint32_t turn() {
    const auto next = side.take_turn(flow_test::now_ms(at));
    return next ? next->value : 0;
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
