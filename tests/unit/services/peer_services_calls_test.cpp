// Calls of local callers: each answered to who made it, or ended.
#include <gtest/gtest.h>

#include <utility>

#include "unit/services/calls_script.hpp"

namespace connect_bridge::side_test {
namespace {

TEST(PeerServices, CallsAreAnsweredToTheirCallers) {
  Script s(server({callable()}));
  mirrored(s);
  request(s, 11, "q1");
  request(s, 12, "q2");
  EXPECT_EQ(s.said(1), "1.1 q1, 1.2 q2\n");
  s.message(1, 1, 2, "a2");
  s.message(1, 1, 1, "a1");
  EXPECT_EQ(s.did(), "respond 1.12 a2\nrespond 1.11 a1\n");
  s.message(1, 1, 1, "again");
  s.message(1, 1, 9, "never asked");
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(first(s).duplicates, 2U);
  EXPECT_EQ(first(s).pending, 0U);
  EXPECT_EQ(s.status().memory_bytes, 0U);
}

TEST(PeerServices, CallsThatNobodyHereKnowsAreForgottenThere) {
  Script s(server({callable()}));
  s.graph({});
  s.join(1);
  s.pass(kDiscovered);
  s.say(1, Offer{{service_channel(1, "/s")}, true});
  s.said(1);
  s.say(1, Attached{{1}, {1}, {40}, {{38}, {39}}});
  EXPECT_EQ(s.said(1), "forget 1 38 39\n");
  request(s, 1, "q");
  EXPECT_EQ(s.said(1), "1.41 q\n");
}

TEST(PeerServices, ARefusedCallIsDropped) {
  Script s(server({callable()}));
  mirrored(s);
  request(s, 11, "q1");
  request(s, 12, "q2");
  s.say(1, Refuse{{1}, {{1}, {7}}, "limit", "too many"});
  EXPECT_EQ(s.did(), "drop_request 1.11\n");
  s.say(1, Refuse{{1}, {{2}}, "timeout", "no answer"});
  EXPECT_EQ(s.did(), "drop_request 1.12\n");
  EXPECT_EQ(first(s).refused, 1U);
  EXPECT_EQ(first(s).timed_out, 1U);
  EXPECT_NE(s.logged.find("too many"), std::string::npos);
}

TEST(PeerServices, MoreCallsThanThePeerTakesAreRefusedHere) {
  auto capped = callable();
  capped.treatment.calls_max = 1;
  auto options = server({capped});
  options.calls_waiting_max = 2;
  Script s(options);
  mirrored(s);
  for (std::uint32_t i = 1; i <= 5; ++i) request(s, i, "q");
  EXPECT_EQ(s.did(), "drop_request 1.4\ndrop_request 1.5\n");
  EXPECT_EQ(first(s).refused, 2U);
  EXPECT_NE(s.logged.find("too many calls"), std::string::npos);
}

TEST(PeerServices, BytesOfRequestsAreBounded) {
  auto options = server({callable()});
  options.call_bytes_max = 20;
  Script s(options);
  mirrored(s);
  request(s, 1, "ten bytes");
  request(s, 2, "ten bytes");
  EXPECT_EQ(s.did(), "drop_request 1.2\n");
  s.said(1);
  s.acknowledge(1);
  request(s, 3, "ten bytes");
  EXPECT_EQ(s.did(), "");
}

TEST(PeerServices, ACallIsGivenUpALittleLaterThanThePeerDoes) {
  auto timed = callable();
  timed.treatment.call_timeout = std::chrono::seconds(2);
  Script s(server({timed}));
  mirrored(s);
  request(s, 11, "q");
  s.said(1);
  s.acknowledge(1);
  s.pass(2999);
  EXPECT_EQ(s.did(), "");
  s.pass(1);
  EXPECT_EQ(s.did(), "drop_request 1.11\n");
  EXPECT_EQ(s.said(1), "forget 1 1\n");
  EXPECT_NE(s.logged.find("1 call(s) not answered in time, last one of /s"), std::string::npos);
}

// By default no call times out.
TEST(PeerServices, ACallThatWaitsLongIsSaidOnceWhateverWasAnsweredBefore) {
  Script s(server({callable()}));
  mirrored(s);
  request(s, 11, "q");
  s.message(1, 1, 1, "a");
  EXPECT_FALSE(first(s).oldest);
  const auto lines = [&] {
    s.did();
    return std::exchange(s.logged, {});
  };
  lines();
  request(s, 12, "q");
  s.said(1);
  s.acknowledge(1);
  s.pass(9999);
  EXPECT_EQ(lines().find("without an answer"), std::string::npos);
  s.pass(1);
  EXPECT_EQ(first(s).oldest, Duration(std::chrono::seconds(10)));
  EXPECT_NE(lines().find("1 call(s) without an answer for 10 s, last one of /s: its server at "),
            std::string::npos);
  request(s, 13, "q");
  s.said(1);
  s.acknowledge(1);
  s.pass(30'000);
  EXPECT_EQ(lines().find("without an answer"), std::string::npos) << "it is always slow";
  s.message(1, 1, 3, "late");
  s.message(1, 1, 2, "late");
  request(s, 14, "q");
  s.message(1, 1, 4, "at once");
  request(s, 15, "q");
  s.pass(10'000);
  EXPECT_NE(lines().find("the request has not arrived at "), std::string::npos);
}

// Small answers of a hostile peer must not become gigabytes here, in the loop or in workers.
TEST(PeerServices, FewBytesOfAnswersDoNotBecomeGigabytes) {
  Script s(server({callable()}));
  mirrored(s);
  constexpr std::uint32_t kCalls = 40;
  for (std::uint32_t i = 1; i <= kCalls; ++i) request(s, i, "q");
  s.did();
  for (std::uint32_t i = 1; i <= kCalls; ++i)
    s.message(1, 1, i, Payload::adopt(Bytes(2000, 0)), Codec::kZstd, 64 << 20);
  const std::string did = s.did();
  EXPECT_EQ(did.substr(0, 13), "decompress 1\n");
  EXPECT_EQ(did.find("decompress", 1), std::string::npos);
  EXPECT_EQ(first(s).refused, kCalls - 1);
}

TEST(PeerServices, AnAnswerBeingDecompressedOutlivesTheConnection) {
  auto options = server({callable()});
  options.compress_job_bytes = 1000;
  Script s(options);
  s.graph({});
  const Token128 session = s.join(1);
  s.pass(kDiscovered);
  s.say(1, Offer{{service_channel(1, "/s")}, true});
  s.say(1, Attached{{1}, {1}, {0}});
  request(s, 11, "q");
  s.compressed(1, 1, 1, std::string(2000, 'a'));
  s.lose(1);
  s.join(2, session);
  s.say(2, Offer{{service_channel(1, "/s")}, true});
  s.say(2, Attached{{1}, {2}, {1}});  // the peer knows that the answer arrived
  s.did();
  s.give(JobDone{{1}, sample("a")});
  EXPECT_EQ(s.did(), "respond 1.11 a\n");
}

// Calls of nodes here reach that server, and not the peer's.
TEST(PeerServices, AServerOfThisGraphIsSaidBesideThePeers) {
  Script s(server({callable()}));
  mirrored(s);
  const auto imported = [&] {
    const Status status = s.status();
    for (const ServiceStatus& one : status.links.at(0).services)
      if (!one.exported) return one;
    return ServiceStatus{};
  };
  EXPECT_FALSE(imported().also_here);
  s.graph({}, {service("/s")});
  s.pass(kDiscovered);
  EXPECT_EQ(imported().service, "/s");
  EXPECT_TRUE(imported().also_here);
}

}  // namespace
}  // namespace connect_bridge::side_test
