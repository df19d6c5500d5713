// A service with a real server, and a peer that may call it, without a side.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/policy/interface.hpp"
#include "core/services/local_services.hpp"
#include "unit/topics/one_link.hpp"

namespace connect_bridge::side_test {

using topics_test::ms;
using topics_test::OneLink;

// Peer 1 is offered the service on channel 1; beside it there is the action /go. Time is in
// milliseconds: every input is handled at the present moment. From 1000 bytes on a worker
// compresses.
struct Served : topics_test::Actions {
  explicit Served(const Rule& rule = callable(), const ServiceKey& key = {"/s", kServiceType})
      : subject(key, exports) {
    policy = Policy({rule});
    servers({1});
    offered = offer();
    EXPECT_TRUE(offered);
  }

  // ---- the graph
  // The servers of the service: of a node each, or all of this one.
  void servers(const std::vector<std::uint8_t>& ids, const std::string& node = "") {
    const auto& [name, type] = subject.key();
    ServiceState state = service(name, ids);
    state.type = type;
    if (!node.empty())
      for (Server& server : state.servers) server.node_name = node;
    show(std::move(state));
    subject.update_servers(graph.services().at(subject.key()), ms(at));
  }
  // The graph has this service, and the action.
  void show(ServiceState state) {
    GraphChanged picture;
    for (const ActionPart part : kActionParts) {
      const std::string name = name_of_part("/go", part);
      const std::string type = type_of_part("p/action/Go", part);
      if (name == state.name) continue;
      if (kind_of(part) == InterfaceKind::kService) {
        picture.services.push_back(service(name));
        picture.services.back().type = type;
      } else {
        picture.topics.push_back(topic(name).pub(1));
        picture.topics.back().type = type;
      }
    }
    picture.services.push_back(std::move(state));
    graph = GraphView(std::move(picture));
    actions.update(graph, claims);
  }

  // ---- the peer
  std::optional<ChannelOffer> offer() { return subject.offer(peer.link, ms(at)); }
  // A peer attaches to what it is offered on this channel; its requests come on that number, too.
  void ask(OneLink& from, std::uint32_t channel = 1) {
    EXPECT_TRUE(from.link.outgoing({channel})->on_attach(Attach{{channel}, {channel}}, ms(at)));
  }
  void attach() {
    ask(peer);
    ready(1);
    did();
    said();
  }
  bool request(std::uint32_t call, const std::string& text, Codec codec = Codec::kNone) {
    InMessage message;
    message.channel = {1};
    message.subject = CallId{call};
    message.body = sample(text);
    message.codec = codec;
    message.raw_bytes =
        codec == Codec::kNone ? static_cast<std::uint32_t>(message.body.size()) : 2000;
    return static_cast<bool>(
        peer.link.incoming({1})->channel->on_message(std::move(message), ms(at)));
  }
  void forget(std::uint32_t call) {
    EXPECT_TRUE(peer.link.outgoing({1})->on_forget(Forget{{1}, {{call}}}, ms(at)));
  }
  // The peer has the answer.
  void deliver(std::uint32_t call) { peer.link.outgoing({1})->on_delivered({call}, ms(at)); }
  void detach() { peer.link.incoming({1})->channel->on_withdraw({}, ms(at)); }
  void lose() {
    subject.on_link_lost({1});
    peer.lose();
    peer.connect();
  }
  std::string said() { return peer.said(at); }

  // ---- the client
  void ready(std::uint32_t client, bool is_ready = true) {
    subject.on(ServiceReady{{client}, is_ready, ""}, ms(at));
  }
  void fail_client(std::uint32_t client) {
    subject.on(ServiceClientFailed{{client}, "type_unknown", "no such type"}, ms(at));
  }
  void fail(std::uint32_t invocation) {
    subject.on(InvocationFailed{subject.client(), {invocation}, "no"}, ms(at));
  }
  void answer(std::uint32_t invocation, const std::string& text) {
    ResponseTaken response{subject.client(), {invocation}, sample(text)};
    subject.on(response, ms(at));
  }

  // Every deadline up to this moment.
  void pass_to(std::int64_t to) {
    at = to;
    while (const auto due = exports.timers.take_due(ms(at).steady)) {
      if (due->call) {
        due->service_offer->on_timeout(*due->call, ms(at));
      } else if (due->service_offer) {
        due->service_offer->detach("the peer does not attach again", ms(at));
      }
    }
  }
  // What its calls hold of the peer's budgets: calls, bytes of requests, of answers.
  [[nodiscard]] std::string held() const {
    const CallLoad& load = exports.loads.at({1});
    return std::to_string(load.calls.used()) + " " + std::to_string(load.request_bytes.used()) +
           " " + std::to_string(load.answer_bytes.used());
  }

  std::int64_t at = 0;
  ServiceOptions options;
  Random random{1};
  LocalServices exports{side, options, random};
  OneLink peer;
  LocalService subject;
  std::optional<ChannelOffer> offered;  // at first
};

}  // namespace connect_bridge::side_test
