// Calls of peers: each executed once and within its bounds, its answer kept until it has arrived.
#include <gtest/gtest.h>

#include "unit/services/calls_script.hpp"

namespace connect_bridge::side_test {
namespace {

TEST(LocalServices, ACallAndItsAnswer) {
  Script s(server({callable()}));
  s.graph({}, {service("/s")});
  s.join(1);
  s.say(1, Attach{{1}, {1}});
  EXPECT_EQ(s.did(), "call_service 1 /s\n");
  EXPECT_EQ(s.said(1), "");  // the server cannot be reached yet
  s.give(ServiceReady{{1}, true, "hash"});
  EXPECT_EQ(s.said(1), "attached 1 1 seen 0\n");
  s.message(1, 1, 1, "q1");
  s.message(1, 1, 2, "q2");
  EXPECT_EQ(s.did(), "invoke 1.1 q1\ninvoke 1.2 q2\n");
  answer(s, 2, "a2");
  answer(s, 1, "a1");
  EXPECT_EQ(s.said(1), "1.2 a2, 1.1 a1\n");
  EXPECT_EQ(first(s).pending, 2U);  // until the peer has the answers
  s.acknowledge(1);
  EXPECT_EQ(first(s).pending, 0U);
  EXPECT_EQ(s.status().memory_bytes, 0U);
  answer(s, 1, "again");
  EXPECT_EQ(s.said(1), "");
}

// A server may leave calls unanswered, and nobody knows how many it has taken.
TEST(LocalServices, WhatHoldsUpCallsIsSaid) {
  auto rule = callable();
  rule.treatment.server_queue = 2;
  rule.treatment.calls_max = 3;
  Script s(server({rule}));
  attached(s);
  for (std::uint32_t call = 1; call <= 5; ++call) s.message(1, 1, call, "q");
  EXPECT_EQ(s.did(), "invoke 1.1 q\ninvoke 1.2 q\n");
  s.pass(999);
  s.did();
  EXPECT_EQ(s.logged.find("wait:"), std::string::npos);
  s.pass(1);
  s.did();
  EXPECT_NE(s.logged.find("calls of /s wait: its server has not answered"), std::string::npos);
  s.pass(4000);
  EXPECT_EQ(s.did(), "invoke 1.3 q\n");
  s.pass(1000);
  s.did();
  EXPECT_NE(s.logged.find("as many unanswered as `calls_max` allows"), std::string::npos);
}

TEST(LocalServices, BeyondWhatMayWaitACallIsRefused) {
  auto capped = callable();
  capped.treatment.calls_max = 2;
  auto options = server({capped});
  options.calls_waiting_max = 1;
  Script s(options);
  attached(s);
  for (std::uint32_t call = 1; call <= 5; ++call) s.message(1, 1, call, "q");
  EXPECT_EQ(s.said(1), "refuse 1 4 limit\nrefuse 1 5 limit\n");
  EXPECT_EQ(s.did(), "invoke 1.1 q\ninvoke 1.2 q\n");
  EXPECT_NE(s.logged.find("refused"), std::string::npos);
  EXPECT_EQ(first(s).refused, 2U);
}

TEST(LocalServices, CallsOfAllServicesThatAPeerMayHaveAreBounded) {
  auto options = server({callable()});
  options.calls_waiting_max = 10'000;
  Script s(options);
  s.graph({}, {service("/a"), service("/b")});
  s.join(1);
  for (const std::uint32_t id : {1U, 2U}) {
    s.say(1, Attach{{id}, {id}});
    s.give(ServiceReady{{id}, true, ""});
  }
  s.said(1);
  for (std::uint32_t call = 1; call <= 4096; ++call)
    for (const std::uint32_t id : {1U, 2U}) s.message(1, id, call, "q");
  EXPECT_EQ(s.said(1), "");
  s.message(1, 1, 4097, "q");
  EXPECT_EQ(s.said(1), "refuse 1 4097 limit\n");
}

TEST(LocalServices, BytesOfRequestsAndAnswersAreBounded) {
  auto capped = callable();
  capped.treatment.calls_max = 2;
  auto options = server({capped});
  options.call_bytes_max = 20;
  Script s(options);
  attached(s);
  s.message(1, 1, 1, "goes to the server at once");
  EXPECT_EQ(s.said(1), "refuse 1 1 limit\n");
  s.message(1, 1, 2, "short");
  s.message(1, 1, 3, "ten bytes");
  s.message(1, 1, 4, "ten bytes");
  s.message(1, 1, 5, "ten bytes");
  EXPECT_EQ(s.said(1), "refuse 1 5 limit\n");
  answer(s, 1, "an answer of too many bytes");
  EXPECT_EQ(s.said(1), "refuse 1 2 limit\n");
}

TEST(LocalServices, ASmallRequestThatDoesNotDecompressEndsTheConnection) {
  Script s(server({callable()}));
  attached(s);
  s.message(1, 1, 1, sample("no zstd"), Codec::kZstd, 100);
  EXPECT_EQ(s.did(), "close 1 4002\n");
  EXPECT_EQ(s.status().memory_bytes, 0U);
}

}  // namespace
}  // namespace connect_bridge::side_test
