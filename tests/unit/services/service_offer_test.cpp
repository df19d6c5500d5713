// A service for one link, and its calls, without a side.
#include "core/services/service_offer.hpp"

#include "unit/services/served.hpp"

namespace connect_bridge::side_test {
namespace {

// Each may make a client in the graph; a new link of the same identity gets no more.
TEST(ServiceOffer, WhoAttachesWithoutEndIsEnded) {
  Served s;
  s.peer.link.account->attaches = Pace(3, std::chrono::milliseconds(20));
  const auto attach = [&](std::uint32_t requests, std::int64_t at) {
    const auto result = s.peer.link.outgoing({1})->on_attach(Attach{{1}, {requests}}, ms(at));
    if (result) s.peer.link.incoming({requests})->channel->on_withdraw({}, ms(at));
    return result ? CloseCode::kNormal : result.error().code;
  };
  for (std::uint32_t n = 1; n <= 3; ++n) EXPECT_EQ(attach(n, 0), CloseCode::kNormal);
  EXPECT_EQ(attach(4, 0), CloseCode::kTooLarge);
  EXPECT_EQ(attach(5, 20), CloseCode::kNormal);
}

// Each time the service is offered again, and everything that exists is looked at again.
TEST(ServiceOffer, WhoUsesUpCallNumbersWithoutEndIsEnded) {
  Served s;
  s.peer.link.account->attaches = Pace(1, std::chrono::milliseconds(20));
  s.attach();
  EXPECT_FALSE(s.request(0xF0000000, "last"));
  EXPECT_EQ(s.did(), "");
  EXPECT_TRUE(s.request(1, "a"));  // the refused one has not been seen
}

TEST(ServiceOffer, ARequestIsExecutedOnce) {
  Served s;
  s.attach();
  EXPECT_TRUE(s.request(1, "a"));
  EXPECT_EQ(s.did(), "invoke 1.1 a\n");
  EXPECT_TRUE(s.request(1, "a"));
  EXPECT_EQ(s.did(), "");
}

// The peer counts those that nobody answers in the end.
TEST(ServiceOffer, AResultThatThePeerMayAskForAgainIsNoCallWithoutAnAnswer) {
  Rule rule = callable();
  rule.opens[Direction::kExport][OpenedBy::kActions] = {Pattern::parse("/**").value()};
  Served result(rule, {"/go/_action/get_result", "p/action/Go_GetResult"});
  Served call;
  for (Served* s : {&result, &call}) {
    s->attach();
    EXPECT_TRUE(s->request(1, "a"));
    s->detach();
  }
  EXPECT_EQ(result.exports.unanswered, 0U);
  EXPECT_EQ(call.exports.unanswered, 1U);
}

TEST(ServiceOffer, TwiceIsAnOffence) {
  Served s;
  s.attach();
  EXPECT_FALSE(s.peer.link.outgoing({1})->on_attach(Attach{{1}, {2}}, ms(0)));
}

TEST(ServiceOffer, RequestsBeforeItIsAttachedAreAnOffence) {
  Served s;
  s.ask(s.peer);
  EXPECT_FALSE(s.request(1, "a"));
}

TEST(ServiceOffer, ACallThatIsForgottenMakesWayForTheNext) {
  Rule one = callable();
  one.treatment.calls_max = 1;
  Served s(one);
  s.attach();
  s.request(1, "a");
  s.request(2, "bc");
  s.did();
  s.forget(1);
  EXPECT_EQ(s.did(), "drop_invocation 1.1\ninvoke 1.2 bc\n");
}

TEST(ServiceOffer, WhatTheLinkLosesTheNextConnectionFinds) {
  Served s;
  s.attach();
  s.request(1, "a");
  s.lose();
  s.answer(1, "b");
  EXPECT_EQ(s.said(), "");
  ASSERT_TRUE(s.offer());
  s.ask(s.peer, 2);
  EXPECT_EQ(s.said(), "attached 2 2 seen 1 open 1\n2.1 b\n");
}

TEST(ServiceOffer, WithoutAnAttachInTimeItsCallsEnd) {
  Served s;
  s.attach();
  s.request(1, "a");
  s.did();
  s.lose();
  ASSERT_TRUE(s.offer());
  s.pass_to(29'999);
  EXPECT_EQ(s.did(), "");
  s.pass_to(30'000);
  EXPECT_EQ(s.did(), "drop_invocation 1.1\nuncall_service 1\n");
}

}  // namespace
}  // namespace connect_bridge::side_test
