// A peer's service, as one link offers it, without a side.
#include "core/services/peer_service.hpp"

#include "unit/services/fed.hpp"

namespace connect_bridge::side_test {
namespace {

TEST(PeerService, AnAnswerGoesToItsCaller) {
  Fed s;
  s.request(7, "a");
  s.request(8, "b");
  EXPECT_EQ(s.said(), "1.1 a, 1.2 b\n");
  s.answer(2, "B");
  s.answer(1, "A");
  s.answer(1, "A");  // once
  EXPECT_EQ(s.did(), "respond 1.8 B\nrespond 1.7 A\n");
  EXPECT_EQ(s.held(), "0 0");
}

TEST(PeerService, ACallerThatGoesIsToldWhenThePeerHasItsRequest) {
  Fed s;
  s.request(7, "a");
  s.said();
  s.subject->on_callers_gone({{1}, {{7}}});
  EXPECT_EQ(s.did(), "drop_request 1.7\n");
  EXPECT_EQ(s.said(), "");
  s.deliver(1);
  EXPECT_EQ(s.said(), "forget 1 1\n");
  EXPECT_EQ(s.held(), "0 0");
}

// What it asked for would be done later, for nobody.
TEST(PeerService, ARequestThatWaitsIsNotSentWhenItsCallerGoes) {
  Fed s;
  s.request(7, "a");
  s.request(8, "b");
  s.subject->on_callers_gone({{1}, {{7}}});
  EXPECT_EQ(s.did(), "drop_request 1.7\n");
  EXPECT_EQ(s.said(), "1.2 b\n");
  EXPECT_EQ(s.held(), "1 5");
}

TEST(PeerService, ReconcilesAfterAReconnect) {
  Fed s;
  for (std::uint32_t id = 1; id <= 4; ++id) s.request(id, std::to_string(id));
  s.lose();
  s.subject->on_callers_gone({{1}, {{2}}});
  s.did();
  s.offer();
  EXPECT_EQ(s.said(), "attach 1 2\n");
  // It has 1 and knows 2, whose caller has gone; 3 was answered on the lost connection.
  EXPECT_TRUE(s.attached({3}, {{1}, {2}}, 2));
  EXPECT_EQ(s.did(), "drop_request 1.3\n");
  EXPECT_EQ(s.said(), "forget 1 2\n2.4 4\n");
  EXPECT_EQ(s.held(), "2 5");
}

TEST(PeerService, AWithdrawEndsTheMirrorAndItsService) {
  Fed s;
  s.request(7, "a");
  s.withdraw(s.peer);
  EXPECT_EQ(s.did(), "unmirror_service 1\n");
  EXPECT_TRUE(s.imports.services.empty());
  EXPECT_EQ(s.held(), "0 0");
}

TEST(PeerService, AttachedTwiceIsAnOffence) {
  Fed s;
  EXPECT_FALSE(s.attached({}, {}));
}

}  // namespace
}  // namespace connect_bridge::side_test
