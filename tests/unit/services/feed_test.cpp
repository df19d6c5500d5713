// A peer's service, as one link offers it, without a side.
#include "core/services/feed.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "core/compress/compress.hpp"
#include "core/services/mirrored_service.hpp"
#include "unit/topics/one_link.hpp"

namespace connect_bridge::side_test {
namespace {

using topics_test::ms;

// Link 1 offers /s on its channel 1; the mirror is 1, and requests go out on our channel 1. From
// 1000 bytes on a worker compresses.
struct Fed : topics_test::Actions {
  explicit Fed(Rule rule = callable()) {
    policy = Policy({std::move(rule)});
    mirroring.graph_since = ms(-1000).steady;
    offer();
    EXPECT_EQ(peer.said(), "attach 1 1\n");
    EXPECT_TRUE(attached({}, {}));
    EXPECT_EQ(did(), "mirror_service 1 /s\n");
  }
  ~Fed() { mirroring.services.clear(); }

  void offer() {
    auto& service = mirroring.services[{"/s", kServiceType}];
    if (!service)
      service = std::make_unique<MirroredService>(ServiceKey{"/s", kServiceType}, mirroring);
    subject = service.get();
    peer.link.expect_offered({1}, InterfaceKind::kService);
    const auto decision = policy.decide(
        Direction::kImport, {InterfaceKind::kService, "/s", kServiceType, ""}, peer.link.identity);
    EXPECT_TRUE(subject->on_offer(peer.link, service_channel(1, "/s"), *decision));
    mirroring.update(*subject, ms(0));
  }
  // The peer has seen requests up to this, and still has these calls.
  bool attached(CallId seen, std::vector<CallId> calls, std::uint32_t requests = 1) {
    return static_cast<bool>(peer.link.incoming({1})->on_attached(
        Attached{{1}, {requests}, seen, std::move(calls), ""}, ms(0)));
  }
  void request(std::uint32_t id, const std::string& text) {
    RequestTaken taken{{1}, {id}, sample(text)};
    subject->on_request(taken, ms(0));
  }
  void answer(std::uint32_t call, const std::string& text) {
    InMessage message;
    message.channel = {1};
    message.subject = CallId{call};
    message.body = sample(text);
    EXPECT_TRUE(peer.link.incoming({1})->on_message(std::move(message), ms(0)));
  }
  void lose() {
    subject->on_link_lost({1});
    peer.link.forget_channels();
    peer.said();
  }
  // Calls, bytes of requests that the peer is not known to have.
  [[nodiscard]] std::string held() const {
    const MadeLoad& load = mirroring.loads.at({1});
    return std::to_string(load.calls.used()) + " " + std::to_string(load.request_bytes.used());
  }

  ServiceOptions options;
  std::string own_node = "/connect";
  PeerTypes types{outputs};
  Mirroring mirroring{side, options, own_node, types};
  topics_test::OneLink peer;
  MirroredService* subject = nullptr;
};

// It may have come in a packet of a megabyte, of which nobody would know.
TEST(Feed, AnAnswerThatWaitsDoesNotKeepItsPacket) {
  Fed s;
  s.request(7, "a");
  const auto packet = std::make_shared<Bytes>();
  EXPECT_TRUE(s.peer.link.incoming({1})->on_message(topics_test::call_in(packet), ms(0)));
  EXPECT_NE(s.did().find("decompress"), std::string::npos);
  EXPECT_EQ(packet.use_count(), 1);
}

TEST(Feed, AnAnswerGoesToItsCaller) {
  Fed s;
  s.request(7, "a");
  s.request(8, "b");
  EXPECT_EQ(s.peer.said(), "1.1 a, 1.2 b\n");
  s.answer(2, "B");
  s.answer(1, "A");
  s.answer(1, "A");  // once
  EXPECT_EQ(s.did(), "respond 1.8 B\nrespond 1.7 A\n");
  EXPECT_EQ(s.held(), "0 0");
}

TEST(Feed, ARequestIsKeptUntilThePeerHasIt) {
  Fed s;
  s.request(7, "a");
  EXPECT_EQ(s.held(), "1 5");
  s.peer.link.outgoing({1})->on_delivered({1}, ms(0));
  EXPECT_EQ(s.held(), "1 0");
}

TEST(Feed, ACallerThatGoesIsToldWhenThePeerHasItsRequest) {
  Fed s;
  s.request(7, "a");
  s.peer.said();
  s.subject->on_callers_gone({{1}, {{7}}});
  EXPECT_EQ(s.did(), "drop_request 1.7\n");
  EXPECT_EQ(s.peer.said(), "");
  s.peer.link.outgoing({1})->on_delivered({1}, ms(0));
  EXPECT_EQ(s.peer.said(), "forget 1 1\n");
  EXPECT_EQ(s.held(), "0 0");
}

// What it asked for would be done later, for nobody.
TEST(Feed, ARequestThatWaitsIsNotSentWhenItsCallerGoes) {
  Fed s;
  s.request(7, "a");
  s.request(8, "b");
  s.subject->on_callers_gone({{1}, {{7}}});
  EXPECT_EQ(s.did(), "drop_request 1.7\n");
  EXPECT_EQ(s.peer.said(), "1.2 b\n");
  EXPECT_EQ(s.held(), "1 5");
}

TEST(Feed, ReconcilesAfterAReconnect) {
  Fed s;
  for (std::uint32_t id = 1; id <= 4; ++id) s.request(id, std::to_string(id));
  s.lose();
  s.subject->on_callers_gone({{1}, {{2}}});
  s.did();
  s.offer();
  EXPECT_EQ(s.peer.said(), "attach 1 2\n");
  // It has 1 and knows 2, whose caller has gone; 3 was answered on the lost connection.
  EXPECT_TRUE(s.attached({3}, {{1}, {2}}, 2));
  EXPECT_EQ(s.did(), "drop_request 1.3\n");
  EXPECT_EQ(s.peer.said(), "forget 1 2\n2.4 4\n");
  EXPECT_EQ(s.held(), "2 5");
}

TEST(Feed, ARefusalEndsTheCall) {
  Fed s;
  s.request(7, "a");
  EXPECT_TRUE(s.peer.link.incoming({1})->on_refuse(Refuse{{1}, {{1}}, "limit", "too many"}, ms(0)));
  EXPECT_EQ(s.did(), "drop_request 1.7\n");
  EXPECT_EQ(s.held(), "0 0");
}

TEST(Feed, TimeEndsACall) {
  Rule timed = callable();
  timed.treatment.call_timeout = std::chrono::seconds(2);
  Fed s(timed);
  s.request(7, "a");
  EXPECT_FALSE(s.mirroring.timers.take_due(ms(2999).steady));
  const auto call = s.mirroring.timers.take_due(ms(3000).steady);
  ASSERT_TRUE(call);
  (*call)->feed().on_timeout(**call, ms(3000));
  EXPECT_EQ(s.did(), "drop_request 1.7\n");
}

TEST(Feed, AWithdrawEndsTheMirrorAndItsService) {
  Fed s;
  s.request(7, "a");
  IncomingChannel* channel = s.peer.link.incoming({1});
  s.peer.link.forget({1});
  channel->on_withdraw({}, ms(0));
  EXPECT_EQ(s.did(), "unmirror_service 1\n");
  EXPECT_TRUE(s.mirroring.services.empty());
  EXPECT_EQ(s.held(), "0 0");
}

TEST(Feed, AttachedTwiceIsAnOffence) {
  Fed s;
  EXPECT_FALSE(s.attached({}, {}));
}

}  // namespace
}  // namespace connect_bridge::side_test
