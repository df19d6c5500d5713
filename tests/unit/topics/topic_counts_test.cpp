// Each message that does not arrive is counted, also when a channel ends.
#include <gtest/gtest.h>

#include <string>

#include "unit/topics/exporting.hpp"

namespace connect_bridge::topics_test {
namespace {

TopicStatus counts_kept(const OneLink& peer) {
  TopicStatus counted;
  counted.topic = "/a";
  counted.type = kType;
  counted.exported = true;
  peer.link.add_past(counted);
  return counted;
}

void lose(OneLink& peer, Exporting& s) {
  peer.link.lose(Loss::kBreak, ms(10));
  s.subject.on_link_lost(peer.link.id, ms(10));
  peer.link.drop_connection();
}

// A sample that waits for the demand of a peer that listens.
struct EarlySample {
  EarlySample() {
    ListenerReport told;
    told.listener = {1};
    told.name = "/a";
    told.type = kType;
    EXPECT_TRUE(s.context.listeners.on_listeners(peer.link, {{told}, {}}, ms(0)).ok());
    s.see(topic("/a").pub(1));
    s.offer(peer);
    s.take(1, "early");
    EXPECT_GT(s.context.early.used(), 0U);
  }
  OneLink peer;  // outlives what refers to it
  Exporting s;
};

TEST(LocalTopicCounts, OfALostConnectionHaveWhatAWorkerHad) {
  OneLink peer;
  Rule rule = everything();
  rule.treatment.compression = {Codec::kZstd, 5};
  Exporting s({rule});
  s.see(topic("/a").pub(1));
  s.offer(peer);
  s.demand(peer);
  s.take(1, std::string(2000, 'x'));
  EXPECT_NE(s.did().find("compress 1"), std::string::npos);
  lose(peer, s);
  EXPECT_EQ(counts_kept(peer).dropped.total(), 1U);
}

TEST(LocalTopicCounts, OfALostConnectionHaveEarlySamples) {
  EarlySample early;
  lose(early.peer, early.s);
  EXPECT_EQ(counts_kept(early.peer).dropped.total(), 1U);
}

TEST(LocalTopicCounts, ADeclineEndsEarlySamples) {
  EarlySample early;
  early.peer.link.outgoing({1})->on_decline({{1}, "not_permitted", "no"}, ms(0));
  EXPECT_EQ(early.s.context.early.used(), 0U);
}

TEST(LocalTopicCounts, OfAWithdrawnTopicStay) {
  OneLink peer;
  Exporting s;
  s.see(topic("/a").pub(1));
  s.offer(peer);
  s.demand(peer);
  s.subject.on_lost({{}, 3, false}, ms(0));
  s.policy = Policy({rule({"/b"}, {})});
  s.subject.review(peer.link, ms(0));
  EXPECT_EQ(counts_kept(peer).dropped.total(), 3U);
}

}  // namespace
}  // namespace connect_bridge::topics_test
