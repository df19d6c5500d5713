// Services that peers offer, without a side.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/policy/interface.hpp"
#include "core/services/peer_services.hpp"
#include "unit/topics/one_link.hpp"

namespace connect_bridge::side_test {

using topics_test::ms;
using topics_test::OneLink;

// A service of the action /go.
inline ChannelOffer offer_of_part(std::uint32_t channel, ActionPart part,
                                  const std::string& type = "p/action/Go") {
  ChannelOffer offer = service_channel(channel, name_of_part("/go", part));
  offer.type = type_of_part(type, part);
  offer.action_type = type;
  return offer;
}

// The local graph has been known for long. Time is in milliseconds: every input is handled at
// the present moment. From 1000 bytes on a worker compresses.
struct OfferedServices : topics_test::Actions {
  explicit OfferedServices(const Rule& rule = callable()) {
    policy = Policy({rule});
    imports.graph_since = ms(-10'000).steady;
  }
  ~OfferedServices() { imports.services.clear(); }

  ServiceMirror& offer(OneLink& from, const ChannelOffer& offer) {
    const ServiceKey key{offer.name, offer.type};
    ServiceMirror& service = imports.services.try_emplace(key, key, imports).first->second;
    from.link.expect_offered(offer.channel, InterfaceKind::kService);
    const auto decision = policy.decide(
        Direction::kImport, {InterfaceKind::kService, offer.name, offer.type, offer.action_type},
        from.link.login.identity());
    EXPECT_TRUE(decision);
    EXPECT_TRUE(service.on_offer(from.link, offer, decision.value(), ms(at)));
    imports.update(service, ms(at));
    return imports.services.at(key);
  }
  bool attached(OneLink& from, const Attached& attached) {
    return static_cast<bool>(
        from.link.incoming(attached.channel)->channel->on_attached(attached, ms(at)));
  }
  void withdraw(OneLink& from, std::uint32_t channel = 1) {
    IncomingChannel* ended = from.link.incoming({channel})->channel;
    from.link.forget({channel});
    ended->on_withdraw({}, ms(at));
  }
  void update() { imports.on_graph(ms(at)); }
  // Every deadline up to this moment.
  void pass_to(std::int64_t to) {
    at = to;
    imports.on_time(ms(at));
  }
  std::string said() { return peer.said(at); }
  // What calls hold of the first peer's budgets: calls, bytes of requests that it is not known to
  // have.
  [[nodiscard]] std::string held() const {
    const CallLoad& load = imports.loads.at({1});
    return std::to_string(load.calls.used()) + " " + std::to_string(load.request_bytes.used());
  }

  std::int64_t at = 0;
  ServiceOptions options;
  std::string own_node = "/connect";
  PeerServices imports{side, options, own_node};
  OneLink peer;
};

// Peer 1 offers /s on its channel 1; the mirror is 1, and requests go out on our channel 1.
struct Fed : OfferedServices {
  explicit Fed(const Rule& rule = callable()) : OfferedServices(rule) {
    offer();
    EXPECT_EQ(said(), "attach 1 1\n");
    EXPECT_TRUE(attached({}, {}));
    EXPECT_EQ(did(), "mirror_service 1 /s\n");
  }

  using OfferedServices::attached;
  using OfferedServices::offer;
  void offer(std::uint32_t epoch = 7) { subject = &offer(peer, service_channel(1, "/s", epoch)); }
  // The peer has seen requests up to this, and still has these calls.
  bool attached(CallId seen, std::vector<CallId> calls, std::uint32_t requests = 1) {
    return attached(peer, Attached{{1}, {requests}, seen, std::move(calls), ""});
  }
  void request(std::uint32_t id, const std::string& text) {
    RequestTaken taken{{1}, {id}, sample(text)};
    subject->on_request(taken, ms(at));
  }
  void answer(std::uint32_t call, const std::string& text) {
    InMessage message;
    message.channel = {1};
    message.subject = CallId{call};
    message.body = sample(text);
    EXPECT_TRUE(peer.link.incoming({1})->channel->on_message(std::move(message), ms(at)));
  }
  // An answer to call 1 that a worker decompresses.
  void answer_slowly() {
    EXPECT_TRUE(peer.link.incoming({1})->channel->on_message(
        topics_test::call_in(std::make_shared<Bytes>()), ms(at)));
  }
  // The peer has the request.
  void deliver(std::uint32_t call) { peer.link.outgoing({1})->on_delivered({call}, ms(at)); }
  void lose() {
    EXPECT_TRUE(subject->on_link_lost({1}));
    peer.lose();
    peer.connect();
    said();
  }

  ServiceMirror* subject = nullptr;
};

}  // namespace connect_bridge::side_test
