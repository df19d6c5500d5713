// A service for one link, and its calls, without a side.
#include "core/services/attachment.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "core/compress/compress.hpp"
#include "core/services/real_service.hpp"
#include "unit/topics/one_link.hpp"

namespace connect_bridge::side_test {
namespace {

using topics_test::ms;

// Link 1 is offered /s, which has a real server. From 1000 bytes on a worker compresses.
struct Served : topics_test::Actions {
  explicit Served(const Rule& rule = callable()) {
    policy = Policy({rule});
    GraphChanged picture;
    picture.services.push_back(connect_bridge::side_test::service("/s"));
    graph = GraphView(std::move(picture));
    subject.update_servers(graph.services().begin()->second, ms(0));
    EXPECT_TRUE(subject.offer(peer.link, ms(0)));
  }
  // Requests come on channel 1.
  void attach() {
    EXPECT_TRUE(peer.link.outgoing({1})->on_attach(Attach{{1}, {1}}, ms(0)));
    subject.on(ServiceReady{{1}, true, ""}, ms(0));
    did();
    peer.said();
  }
  bool request(std::uint32_t call, const std::string& text, Codec codec = Codec::kNone) {
    InMessage message;
    message.channel = {1};
    message.subject = CallId{call};
    message.body = sample(text);
    message.codec = codec;
    message.raw_bytes =
        codec == Codec::kNone ? static_cast<std::uint32_t>(message.body.size()) : 2000;
    return static_cast<bool>(peer.link.incoming({1})->on_message(std::move(message), ms(0)));
  }
  void answer(std::uint32_t invocation, const std::string& text) {
    ResponseTaken response{{1}, {invocation}, sample(text)};
    subject.on(response, ms(0));
  }
  // What its calls hold of the peer's budgets: calls, bytes of requests, of answers.
  [[nodiscard]] std::string held() const {
    const ServedLoad& load = serving.loads.at({1});
    return std::to_string(load.calls.used()) + " " + std::to_string(load.request_bytes.used()) +
           " " + std::to_string(load.answer_bytes.used());
  }

  ServiceOptions options;
  Random random{1};
  Serving serving{side, options, random};
  topics_test::OneLink peer;
  RealService subject{{"/s", kServiceType}, serving};
};

// It may have come in a packet of a megabyte, of which nobody would know.
TEST(Attachment, ARequestThatWaitsDoesNotKeepItsPacket) {
  Served s;
  s.attach();
  const auto packet = std::make_shared<Bytes>();
  EXPECT_TRUE(s.peer.link.incoming({1})->on_message(topics_test::call_in(packet), ms(0)));
  EXPECT_NE(s.did().find("decompress"), std::string::npos);
  EXPECT_EQ(packet.use_count(), 1);
}

TEST(Attachment, HoldsAClientWhileThePeerIsAttached) {
  Served s;
  EXPECT_EQ(s.did(), "");
  s.attach();
  EXPECT_TRUE(s.subject.client());
  s.peer.link.incoming({1})->on_withdraw({}, ms(0));
  EXPECT_EQ(s.did(), "uncall_service 1\n");
}

// Each may make a client in the graph; a new link of the same identity gets no more.
TEST(Attachment, WhoAttachesWithoutEndIsEnded) {
  Served s;
  s.peer.link.account->attaches = Pace(3, std::chrono::milliseconds(20));
  const auto attach = [&](std::uint32_t requests, std::int64_t at) {
    const auto result = s.peer.link.outgoing({1})->on_attach(Attach{{1}, {requests}}, ms(at));
    if (result) s.peer.link.incoming({requests})->on_withdraw({}, ms(at));
    return result ? CloseCode::kNormal : result.error().code;
  };
  for (std::uint32_t n = 1; n <= 3; ++n) EXPECT_EQ(attach(n, 0), CloseCode::kNormal);
  EXPECT_EQ(attach(4, 0), CloseCode::kTooLarge);
  EXPECT_EQ(attach(5, 20), CloseCode::kNormal);
}

// Each time the service is offered anew, and all that there is is looked at again.
TEST(Attachment, WhoUsesUpCallNumbersWithoutEndIsEnded) {
  Served s;
  s.peer.link.account->attaches = Pace(1, std::chrono::milliseconds(20));
  s.attach();
  EXPECT_FALSE(s.request(0xF0000000, "last"));
  EXPECT_EQ(s.did(), "");
  EXPECT_TRUE(s.request(1, "a"));  // the refused one has not been seen
}

TEST(Attachment, ARequestIsExecutedOnce) {
  Served s;
  s.attach();
  EXPECT_TRUE(s.request(1, "a"));
  EXPECT_EQ(s.did(), "invoke 1.1 a\n");
  EXPECT_TRUE(s.request(1, "a"));
  EXPECT_EQ(s.did(), "");
}

TEST(Attachment, RequestsBeforeItIsAttachedAreAnOffence) {
  Served s;
  EXPECT_TRUE(s.peer.link.outgoing({1})->on_attach(Attach{{1}, {1}}, ms(0)));
  EXPECT_FALSE(s.request(1, "a"));
}

TEST(Attachment, AnAnswerIsKeptUntilThePeerHasIt) {
  Served s;
  s.attach();
  s.request(1, "abc");
  EXPECT_EQ(s.held(), "1 0 0");  // handed over at once
  s.answer(1, "abcdef");
  EXPECT_EQ(s.held(), "1 0 10");
  EXPECT_EQ(s.peer.said(), "1.1 abcdef\n");
  s.peer.link.outgoing({1})->on_delivered({1}, ms(0));
  EXPECT_EQ(s.held(), "0 0 0");
}

TEST(Attachment, ACallThatIsForgottenGivesBackAllItHolds) {
  Rule one = callable();
  one.treatment.calls_max = 1;
  Served s(one);
  s.attach();
  s.request(1, "a");
  s.request(2, "bc");
  EXPECT_EQ(s.held(), "2 6 0");
  s.did();
  EXPECT_TRUE(s.peer.link.outgoing({1})->on_forget(Forget{{1}, {{1}}}, ms(0)));
  EXPECT_EQ(s.did(), "drop_invocation 1.1\ninvoke 1.2 bc\n");
  EXPECT_TRUE(s.peer.link.outgoing({1})->on_forget(Forget{{1}, {{2}}}, ms(0)));
  EXPECT_EQ(s.held(), "0 0 0");
  EXPECT_EQ(s.serving.gate.waiting(LinkId{1}), 0U);
}

TEST(Attachment, AnInvocationThatFailedIsNotDropped) {
  Served s;
  s.attach();
  s.request(1, "a");
  s.did();
  s.subject.on(InvocationFailed{{1}, {1}, "no"}, ms(0));
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.peer.said(), "refuse 1 1 failed\n");
  EXPECT_EQ(s.held(), "0 0 0");
}

TEST(Attachment, ACallThatEndsCancelsItsJob) {
  Served s;
  s.attach();
  s.request(1, "not really compressed", Codec::kZstd);
  EXPECT_EQ(s.did(), "decompress 1\n");
  EXPECT_TRUE(s.peer.link.outgoing({1})->on_forget(Forget{{1}, {{1}}}, ms(0)));
  EXPECT_EQ(s.did(), "cancel 1\n");
  s.finish(sample("a"));
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.held(), "0 0 0");
}

TEST(Attachment, WhatTheLinkLosesTheNextConnectionFinds) {
  Served s;
  s.attach();
  s.request(1, "a");
  s.subject.on_link_lost({1});
  s.peer.link.forget_channels();
  s.answer(1, "b");
  EXPECT_EQ(s.peer.said(), "");
  ASSERT_TRUE(s.subject.offer(s.peer.link, ms(0)));
  EXPECT_TRUE(s.peer.link.outgoing({2})->on_attach(Attach{{2}, {5}}, ms(0)));
  EXPECT_EQ(s.peer.said(), "attached 2 5 seen 1 open 1\n2.1 b\n");
}

TEST(Attachment, WithoutAnAttachInTimeItsCallsEnd) {
  Served s;
  s.attach();
  s.request(1, "a");
  s.did();
  s.subject.on_link_lost({1});
  ASSERT_TRUE(s.subject.offer(s.peer.link, ms(0)));
  EXPECT_FALSE(s.serving.timers.take_due(ms(29'999).steady));
  const auto due = s.serving.timers.take_due(ms(30'000).steady);
  ASSERT_TRUE(due);
  due->attachment->detach(ms(30'000));
  EXPECT_EQ(s.did(), "drop_invocation 1.1\nuncall_service 1\n");
}

}  // namespace
}  // namespace connect_bridge::side_test
