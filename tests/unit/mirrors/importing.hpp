// Topics that peers offer, without a side.
#pragma once

#include "core/mirrors/peer_topics.hpp"
#include "unit/topics/one_link.hpp"

namespace connect_bridge::topics_test {

// The local graph has been known for a second. From 1000 bytes on a worker decompresses.
struct Importing : Actions {
  explicit Importing(std::vector<Rule> rules = {everything()}) {
    policy = Policy(std::move(rules));
    context.graph_since = ms(-1000).steady;
  }

  // A peer offers topic /a on channel 1 with these origins.
  void offer(LinkTopics& peer, std::vector<OriginOffer> origins, std::int64_t at = 0) {
    peer.link().expect_offered({1}, InterfaceKind::kTopic);
    peer.on_offer(channel(1, "/a", std::move(origins)), ms(at));
  }
  // The peer's connection is lost.
  static void lose(LinkTopics& peer, std::int64_t at = 0) {
    LinkEnd all;
    EXPECT_TRUE(peer.on_link_lost(all, ms(at)));
  }
  void listen() { graph = picture({topic("/a").sub(50)}); }
  TopicMirror& mirror(std::uint8_t publisher) {
    return context.mirrors.all().at({{"/a", kType}, gid(publisher)});
  }
  // As long as no demand was told its number is 0.
  static InMessage message(const std::string& text, std::uint16_t demand = 0) {
    InMessage result;
    result.channel = {1};
    result.subject = OriginId{1};
    result.demand = demand;
    result.stamp = flow_test::at_ms(1);
    result.body = sample(text);
    result.raw_bytes = static_cast<std::uint32_t>(result.body.size());
    return result;
  }
  // Every deadline up to this moment.
  void pass_to(std::int64_t at) {
    while (const auto due = context.mirrors.timers().take_due(ms(at).steady))
      (*due)->on_time(ms(at));
  }

  TopicOptions options;
  ImportContext context{side, options};
};

}  // namespace connect_bridge::topics_test
