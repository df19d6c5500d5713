// One call of a peer: what it holds, and when it gives that back.
#include "core/services/served_call.hpp"

#include <memory>
#include <utility>
#include <vector>

#include "unit/services/served.hpp"

namespace connect_bridge::side_test {
namespace {

// The server has one call at a time, for 2 s.
Rule one_in_time() {
  Rule rule = callable();
  rule.treatment.calls_max = 1;
  rule.treatment.call_timeout = std::chrono::seconds(2);
  return rule;
}

Rule answers_compressed() {
  Rule rule = callable();
  rule.treatment.compression = {Codec::kZstd, 3};
  return rule;
}

// ---- the request

// It may have come in a packet of a megabyte, of which nobody would know.
TEST(ServedCall, ARequestThatWaitsDoesNotKeepItsPacket) {
  Served s;
  s.attach();
  const auto packet = std::make_shared<Bytes>();
  EXPECT_TRUE(s.peer.link.incoming({1})->channel->on_message(topics_test::call_in(packet), ms(0)));
  EXPECT_NE(s.did().find("decompress"), std::string::npos);
  EXPECT_EQ(packet.use_count(), 1);
}

TEST(ServedCall, HoldsItsRequestWhileItWaits) {
  Served s(one_in_time());
  s.attach();
  s.request(1, "a");
  s.request(2, "bc");
  EXPECT_EQ(s.held(), "2 6 0");
  s.answer(1, "");
  EXPECT_EQ(s.did(), "invoke 1.1 a\ninvoke 1.2 bc\n");
  s.deliver(1);
  EXPECT_EQ(s.held(), "1 0 0");
}

TEST(ServedCall, OneThatWaitsIsForgottenWithoutAWordToTheServer) {
  Served s(one_in_time());
  s.attach();
  s.request(1, "a");
  s.request(2, "b");
  s.did();
  s.forget(2);
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.held(), "1 0 0");
}

// ---- the invocation

TEST(ServedCall, AnInvocationIsDroppedWhenItsCallerLeaves) {
  Served s;
  s.attach();
  s.request(1, "a");
  s.did();
  s.forget(1);
  EXPECT_EQ(s.did(), "drop_invocation 1.1\n");
  s.answer(1, "late");
  EXPECT_EQ(s.said(), "");
  EXPECT_EQ(s.held(), "0 0 0");
}

TEST(ServedCall, AnInvocationThatWasAnsweredIsNotDropped) {
  Served s;
  s.attach();
  s.request(1, "a");
  s.answer(1, "b");
  s.did();
  s.forget(1);
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.held(), "0 0 0");
}

TEST(ServedCall, AnInvocationThatFailedIsNotDropped) {
  Served s;
  s.attach();
  s.request(1, "a");
  s.did();
  s.fail(1);
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.said(), "refuse 1 1 failed\n");
  EXPECT_EQ(s.held(), "0 0 0");
}

// ---- the answer

TEST(ServedCall, AnAnswerIsKeptUntilThePeerHasIt) {
  Served s;
  s.attach();
  s.request(1, "abc");
  EXPECT_EQ(s.held(), "1 0 0");  // handed over at once
  s.answer(1, "abcdef");
  EXPECT_EQ(s.held(), "1 0 10");
  EXPECT_EQ(s.said(), "1.1 abcdef\n");
  s.deliver(1);
  EXPECT_EQ(s.held(), "0 0 0");
}

TEST(ServedCall, AnAnswerWithoutRoomIsRefused) {
  Served s;
  s.attach();
  s.request(1, "a");
  s.options.call_bytes_max = 9;
  s.answer(1, "abcdef");
  EXPECT_EQ(s.said(), "refuse 1 1 limit\n");
  EXPECT_EQ(s.held(), "0 0 0");
}

TEST(ServedCall, ACompressedAnswerHoldsWhatIsLeftOfIt) {
  Served s(answers_compressed());
  s.attach();
  s.request(1, "a");
  s.did();
  s.answer(1, std::string(2000, 'x'));
  EXPECT_EQ(s.did(), "compress 1\n");
  EXPECT_EQ(s.held(), "1 0 2004");
  EXPECT_EQ(s.said(), "");
  s.finish(sample("less"));
  EXPECT_EQ(s.said(), "1.1 zstd\n");
  EXPECT_EQ(s.held(), "1 0 8");
}

TEST(ServedCall, AnAnswerThatDoesNotShrinkIsSentAsItIs) {
  Served s(answers_compressed());
  s.attach();
  s.request(1, "a");
  s.answer(1, std::string(2000, 'x'));
  s.did();
  s.finish({});
  EXPECT_EQ(s.held(), "1 0 2004");
  EXPECT_EQ(s.said().substr(0, 6), "1.1 xx");
}

// ---- its jobs

TEST(ServedCall, OneThatEndsCancelsTheJobOfItsRequest) {
  Served s;
  s.attach();
  s.request(1, "not really compressed", Codec::kZstd);
  EXPECT_EQ(s.did(), "decompress 1\n");
  s.forget(1);
  EXPECT_EQ(s.did(), "cancel 1\n");
  s.finish(sample("a"));
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.held(), "0 0 0");
}

TEST(ServedCall, OneThatEndsCancelsTheJobOfItsAnswer) {
  Served s(answers_compressed());
  s.attach();
  s.request(1, "a");
  s.answer(1, std::string(2000, 'x'));
  s.did();
  s.forget(1);
  EXPECT_EQ(s.did(), "cancel 1\n");
  s.finish(sample("less"));
  EXPECT_EQ(s.said(), "");
  EXPECT_EQ(s.held(), "0 0 0");
}

TEST(ServedCall, ARequestThatDoesNotDecompressEndsTheConnection) {
  Served s;
  s.attach();
  s.request(1, "not really compressed", Codec::kZstd);
  s.did();
  s.finish({});
  EXPECT_EQ(s.did(), "");
  EXPECT_TRUE(s.peer.link.connection()->failure());
  EXPECT_EQ(s.held(), "0 0 0");
}

// ---- its time

TEST(ServedCall, TimeEndsIt) {
  Served s(one_in_time());
  s.attach();
  s.request(1, "a");
  s.did();
  s.pass_to(1999);
  EXPECT_EQ(s.did(), "");
  s.pass_to(2000);
  EXPECT_EQ(s.did(), "drop_invocation 1.1\n");
  EXPECT_EQ(s.said(), "refuse 1 1 timeout\n");
}

TEST(ServedCall, ItsTimeEndsWithTheAnswer) {
  Served s(one_in_time());
  s.attach();
  s.request(1, "a");
  EXPECT_TRUE(s.exports.timers.deadline());
  s.answer(1, "b");
  EXPECT_FALSE(s.exports.timers.deadline());
}

// It lasts as long as the goal does.
TEST(ServedCall, ACallForAResultHasNoLimit) {
  Rule rule = one_in_time();
  rule.opens[Direction::kExport][OpenedBy::kActions] = {Pattern::parse("/**").value()};
  Served s(rule, {"/go/_action/get_result", "p/action/Go_GetResult"});
  s.attach();
  s.request(1, "a");
  EXPECT_EQ(s.did(), "invoke 1.1 a\n");
  EXPECT_FALSE(s.exports.timers.deadline());
}

// ---- all of it

// The server has call 1, and call 2 waits.
TEST(ServedCall, GivesBackAllItHoldsHoweverItEnds) {
  struct End {
    std::string how;
    void (*end)(Served& s);
  };
  const std::vector<End> ends = {
      {"its caller leaves",
       [](Served& s) {
         s.forget(1);
         s.forget(2);
       }},
      {"the peer has its answer",
       [](Served& s) {
         for (const std::uint32_t call : {1U, 2U}) {
           s.answer(call, "a");
           s.deliver(call);
         }
       }},
      {"the server does not take it",
       [](Served& s) {
         s.fail(1);
         s.fail(2);
       }},
      {"its time is over", [](Served& s) { s.pass_to(2000); }},
      {"the peer ends its attachment", [](Served& s) { s.detach(); }},
      {"the link is dead", [](Served& s) { s.subject.on_link_dead({1}, ms(0)); }},
      {"another server comes", [](Served& s) { s.servers({2}); }},
      {"the server cannot be reached", [](Served& s) { s.ready(1, false); }},
      {"the client fails", [](Served& s) { s.fail_client(1); }},
      {"no rule allows it",
       [](Served& s) {
         s.policy = Policy();
         s.subject.review(s.peer.link, ms(0));
       }},
  };
  for (const End& each : ends) {
    Served s(one_in_time());
    s.attach();
    s.request(1, "a");
    s.request(2, "b");
    EXPECT_EQ(s.held(), "2 5 0");
    each.end(s);
    EXPECT_EQ(s.held(), "0 0 0") << each.how;
    EXPECT_EQ(s.exports.loads.at({1}).waiting.used(), 0U) << each.how;
    EXPECT_FALSE(s.exports.timers.deadline()) << each.how;
  }
}

}  // namespace
}  // namespace connect_bridge::side_test
