// One call of a local caller: its request, its time, and its answer.
#include "core/services/made_call.hpp"

#include <chrono>
#include <memory>
#include <string>

#include "unit/services/fed.hpp"

namespace connect_bridge::side_test {
namespace {

Rule answered_in_time() {
  Rule rule = callable();
  rule.treatment.call_timeout = std::chrono::seconds(2);
  return rule;
}

Rule requests_compressed() {
  Rule rule = callable();
  rule.treatment.compression = {Codec::kZstd, 3};
  return rule;
}

// ---- the request

TEST(MadeCall, ARequestIsKeptUntilThePeerHasIt) {
  Fed s;
  s.request(7, "a");
  EXPECT_EQ(s.held(), "1 5");
  s.deliver(1);
  EXPECT_EQ(s.held(), "1 0");
}

TEST(MadeCall, ARequestIsCompressedOnceAndSentAgainAsItIs) {
  Fed s(requests_compressed());
  s.request(7, std::string(2000, 'x'));
  EXPECT_EQ(s.did(), "compress 1\n");
  EXPECT_EQ(s.said(), "");
  EXPECT_EQ(s.held(), "1 2004");
  s.finish(sample("less"));
  EXPECT_EQ(s.said(), "1.1 zstd\n");
  EXPECT_EQ(s.held(), "1 8");
  s.lose();
  s.offer();
  EXPECT_EQ(s.said(), "attach 1 2\n");
  EXPECT_TRUE(s.attached({}, {}, 2));
  EXPECT_EQ(s.said(), "2.1 zstd\n");
  EXPECT_EQ(s.did(), "");
}

TEST(MadeCall, ARequestIsNotSentBeforeItIsCompressed) {
  Fed s(requests_compressed());
  s.request(7, std::string(2000, 'x'));
  s.did();
  s.lose();
  s.offer();
  s.said();
  EXPECT_TRUE(s.attached({}, {}, 2));
  EXPECT_EQ(s.said(), "");
  s.finish(sample("less"));
  EXPECT_EQ(s.said(), "2.1 zstd\n");
}

TEST(MadeCall, ARequestThatHasArrivedIsNotSentAgain) {
  Fed s;
  s.request(7, "a");
  s.said();
  s.deliver(1);
  s.lose();
  s.offer();
  s.said();
  EXPECT_TRUE(s.attached({1}, {{1}}, 2));
  EXPECT_EQ(s.said(), "");
  s.answer(1, "A");
  EXPECT_EQ(s.did(), "respond 1.7 A\n");
}

// The acknowledgement was lost with the connection.
TEST(MadeCall, ARequestThatHasArrivedIsKeptNoLongerAfterAReconnect) {
  Fed s;
  s.request(7, "a");
  s.lose();
  EXPECT_EQ(s.held(), "1 5");
  s.offer();
  EXPECT_TRUE(s.attached({1}, {{1}}, 2));
  EXPECT_EQ(s.held(), "1 0");
}

// ---- its time

TEST(MadeCall, ItsTimeEndsWithTheAnswer) {
  Fed s(answered_in_time());
  s.request(7, "a");
  EXPECT_TRUE(s.imports.timers.deadline());
  s.answer(1, "A");
  EXPECT_FALSE(s.imports.timers.deadline());
}

// It lasts as long as the goal does.
TEST(MadeCall, ACallForAResultHasNoLimit) {
  Rule rule = answered_in_time();
  rule.opens[Direction::kImport][OpenedBy::kActions] = {Pattern::parse("/**").value()};
  OfferedServices s(rule);
  ServiceMirror& results = s.offer(s.peer, offer_of_part(1, ActionPart::kGetResult));
  EXPECT_TRUE(s.attached(s.peer, {{1}, {1}, {}}));
  EXPECT_EQ(s.did(), "mirror_service 1 /go/_action/get_result\n");
  RequestTaken request{{1}, {7}, sample("a")};
  results.on_request(request, ms(0));
  EXPECT_EQ(s.held(), "1 5");
  EXPECT_FALSE(s.imports.timers.deadline());
}

// ---- an answer that a worker decompresses

// It may have come in a packet of a megabyte, of which nobody would know.
TEST(MadeCall, AnAnswerThatWaitsDoesNotKeepItsPacket) {
  Fed s;
  s.request(7, "a");
  const auto packet = std::make_shared<Bytes>();
  EXPECT_TRUE(s.peer.link.incoming({1})->channel->on_message(topics_test::call_in(packet), ms(0)));
  EXPECT_NE(s.did().find("decompress"), std::string::npos);
  EXPECT_EQ(packet.use_count(), 1);
}

TEST(MadeCall, AnAnswerHoldsItsBytesUntilItIsDecompressed) {
  Fed s;
  const Budget& decoding = s.imports.loads.at({1}).answer_bytes;
  s.request(7, "a");
  s.answer_slowly();
  EXPECT_EQ(s.did(), "decompress 1\n");
  EXPECT_GT(decoding.used(), 0U);
  s.finish(sample("A"));
  EXPECT_EQ(s.did(), "respond 1.7 A\n");
  EXPECT_EQ(decoding.used(), 0U);
  EXPECT_EQ(s.held(), "0 0");
}

TEST(MadeCall, TheFirstAnswerCounts) {
  Fed s;
  s.request(7, "a");
  s.answer_slowly();
  s.did();
  s.answer(1, "B");
  EXPECT_EQ(s.did(), "");
  s.finish(sample("A"));
  EXPECT_EQ(s.did(), "respond 1.7 A\n");
}

TEST(MadeCall, AnAnswerWithoutRoomEndsTheCall) {
  Fed s;
  s.request(7, "a");
  const auto others = s.imports.loads.at({1}).answer_bytes.hold(64 << 20);
  s.answer_slowly();
  EXPECT_EQ(s.did(), "drop_request 1.7\n");
  EXPECT_EQ(s.held(), "0 0");
}

TEST(MadeCall, AnAnswerThatDoesNotDecompressEndsTheConnection) {
  Fed s;
  s.request(7, "a");
  s.answer_slowly();
  s.did();
  s.finish({});
  EXPECT_EQ(s.did(), "drop_request 1.7\n");
  EXPECT_TRUE(s.peer.link.connection()->failure());
}

TEST(MadeCall, AnAnswerIsForNobodyWhenItsCallerHasGone) {
  Fed s;
  s.request(7, "a");
  s.said();
  s.answer_slowly();
  s.did();
  s.subject->on_callers_gone({{1}, {{7}}});
  EXPECT_EQ(s.did(), "drop_request 1.7\n");
  s.finish(sample("A"));
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.held(), "0 0");
}

TEST(MadeCall, OneThatEndsCancelsItsJob) {
  Fed s;
  s.request(7, "a");
  s.answer_slowly();
  s.did();
  s.withdraw(s.peer);
  EXPECT_EQ(s.did(), "cancel 1\nunmirror_service 1\n");
  s.finish(sample("A"));
  EXPECT_EQ(s.did(), "");
}

}  // namespace
}  // namespace connect_bridge::side_test
