#include "core/topics/early_samples.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "unit/topics/exporting.hpp"

namespace connect_bridge::topics_test {
namespace {

OutSample early_sample(std::size_t bytes) {
  return {OriginId{1}, 0, 0, Payload::adopt(Bytes(bytes)), {}};
}

// The peer says that it listens to /a.
void listen(Exporting& s, OneLink& peer) {
  ListenerReport told;
  told.listener = {1};
  told.name = "/a";
  told.type = kType;
  EXPECT_TRUE(s.context.listeners.on_listeners(peer.link, {{told}, {}}, ms(0)).ok());
}

// What is kept for one link, of which nothing else is known.
struct Early {
  // How many were dropped.
  std::size_t add(std::size_t bytes, std::int64_t at = 0) {
    return subject.add(early_sample(bytes), ms(at).steady, all, account, ms(at)).count;
  }

  Budget all;
  ExportTimers timers;
  std::shared_ptr<Account> account = std::make_shared<Account>();
  EarlySamples subject{{timers, nullptr}};
};

TEST(EarlySamples, AreKeptForTwoSecondsAfterTheFirst) {
  Early s;
  EXPECT_EQ(s.add(10), 0U);
  EXPECT_EQ(s.add(20, 1500), 0U);
  EXPECT_EQ(s.timers.deadline(), ms(2000).steady);
  EXPECT_FALSE(s.subject.is_late(ms(1999)));
  EXPECT_TRUE(s.subject.is_late(ms(2000)));
  EXPECT_EQ(s.subject.since(), ms(0).steady);
  EXPECT_EQ(s.subject.end().size(), 2U);
  EXPECT_TRUE(s.subject.is_over());
  EXPECT_FALSE(s.subject.is_late(ms(2000)));
  EXPECT_EQ(s.timers.deadline(), std::nullopt);
}

TEST(EarlySamples, TheOldestGivesWayAndAllIsGivenBack) {
  Early s;
  for (int i = 0; i < 100; ++i) EXPECT_EQ(s.add(10), 0U);
  EXPECT_EQ(s.add(10), 1U);
  EXPECT_EQ(s.add(1 << 20), 100U);  // as large as all may be together
  EXPECT_EQ(s.add((1 << 20) + 1), 1U);
  EXPECT_EQ(s.subject.samples().size(), 1U);
  EXPECT_EQ(s.all.used(), 1U << 20);
  EXPECT_EQ(s.account->early.used(), 1U << 20);
  s.subject.end();
  EXPECT_EQ(s.all.used() + s.account->early.used(), 0U);
}

TEST(EarlySamples, WhoListensALittleLaterGetsWhatNobodyHasGot) {
  OneLink first(1), second(2), third(3);
  Exporting s;
  s.see(topic("/a").pub(1));
  listen(s, first);
  s.see(topic("/a").pub(1));
  s.offer(first);
  s.take(1, "early");
  listen(s, second);
  s.offer(second);
  s.take(1, "later");
  s.demand(second);
  EXPECT_EQ(second.said(), "1.1 early, 1.1 later\n");
  EXPECT_EQ(first.said(), "");
  listen(s, third);
  s.offer(third);
  s.take(1, "much later", 1000);
  s.demand(third);
  EXPECT_EQ(third.said(), "1.1 much later\n");
}

// While another one wants what is kept: what was said since it listens, and nothing from before.
TEST(EarlySamples, OfATransientLocalTopicGoToWhoDrives) {
  OneLink other{1}, driven{2};
  Exporting s;
  listen(s, driven);
  s.see(topic("/a").pub(1, latched(3)));
  s.offer(other);
  s.offer(driven);
  s.demand(other);
  s.subject.on_taken({{}, gid(1), flow_test::at_ms(-5), sample("yesterday"), 1}, ms(10));
  s.take(1, "early", 20);
  driven.said();
  driven.link.outgoing({1})->on_demand({.channel = {1}, .number = 1, .live = true}, ms(30));
  EXPECT_EQ(driven.said(), "1.1 early\n");
}

// Its publisher said it when the topic was subscribed already, but was cut off from here.
TEST(EarlySamples, WhoDrivesDoesNotGetWhatComesMuchLaterThanItWasSaid) {
  OneLink other{1}, driven{2};
  Exporting s;
  listen(s, driven);
  s.see(topic("/a").pub(1, latched(3)));
  s.offer(other);
  s.demand(other);
  s.offer(driven);
  s.see(topic("/a").pub(1, latched(3)).pub(2, latched(1)), 5000);
  for (const OneLink* peer : {&other, &driven}) s.subject.tell_origins(peer->link.id);
  other.said();
  s.subject.on_taken({{}, gid(2), flow_test::at_ms(1000), sample("long ago"), 1}, ms(5000));
  driven.said();
  driven.link.outgoing({1})->on_demand({.channel = {1}, .number = 1, .live = true}, ms(5030));
  EXPECT_EQ(driven.said(), "");
  EXPECT_EQ(other.said(), "1.2 long ago\n");
}

// While another one wants what is kept. It is new, and may be the stop.
TEST(EarlySamples, WhoDrivesGetsTheFirstCommandOfANewPublisher) {
  OneLink driven, other{2};
  Exporting s;
  s.see(topic("/a").pub(1, latched(3)));
  s.offer(driven);
  s.offer(other);
  s.demand(other);
  driven.link.outgoing({1})->on_demand({.channel = {1}, .number = 1, .live = true}, ms(100));
  s.see(topic("/a").pub(1, latched(3)).pub(2, latched(1)).pub(3, latched(1)), 200);
  s.subject.tell_origins(driven.link.id);
  driven.said();
  s.subject.on_taken({{}, gid(3), flow_test::at_ms(50), sample("yesterday"), 1}, ms(200));
  s.take(2, "now", 200);
  EXPECT_EQ(driven.said(), "1.2 now\n");
  EXPECT_NE(other.said().find("yesterday"), std::string::npos);
}

// A peer that listens with a weak rule, beside one that demands the topic as it is published.
struct BesideAWeakListener {
  BesideAWeakListener() : s({weak(), everything()}) {
    listens.link.login.set_identity({"weak", {}, 0});
    listen(s, listens);
    s.see(topic("/a").pub(1));
    s.offer(demands);
    s.offer(listens);
    s.demand(demands);
    EXPECT_EQ(s.did(), "subscribe 1 /a best_effort volatile 100\n");
  }
  static Rule weak() {
    Rule rule = everything();
    rule.identities = {"weak"};
    rule.treatment.qos.reliability = Reliability::kBestEffort;
    return rule;
  }

  OneLink demands{1}, listens{2};
  Exporting s;
};

TEST(EarlySamples, WhoDeclinesItWeakensNothingForOthers) {
  BesideAWeakListener all;
  all.listens.link.outgoing({1})->on_decline({{1}, "not_permitted", "no"}, ms(0));
  EXPECT_EQ(all.s.did(), "unsubscribe 1\nsubscribe 2 /a reliable volatile 100\n");
}

TEST(EarlySamples, WhoDoesNotDemandItInTimeWeakensNothingForOthers) {
  BesideAWeakListener all;
  all.s.take(1, "first");
  all.s.pass_to(1999);
  EXPECT_EQ(all.s.did(), "");
  all.s.pass_to(2000);
  EXPECT_EQ(all.s.did(), "unsubscribe 1\nsubscribe 2 /a reliable volatile 100\n");
}

// One that listens to much and answers nothing leaves room to the others.
TEST(EarlySamples, OfOneIdentityLeaveRoomToOthers) {
  OneLink greedy(1), other(2);
  Exporting s;
  std::vector<std::unique_ptr<LocalTopic>> topics;
  std::vector<Topic> states;
  const auto listen_to = [&](OneLink& peer, std::uint32_t n) {
    ListenerReport told;
    told.listener = {n};
    told.name = "/t" + std::to_string(n);
    told.type = kType;
    EXPECT_TRUE(s.context.listeners.on_listeners(peer.link, {{told}, {}}, ms(0)).ok());
  };
  for (std::uint32_t n = 1; n <= 6; ++n) {
    states.push_back(topic("/t" + std::to_string(n)).pub(static_cast<std::uint8_t>(n)));
    listen_to(greedy, n);
  }
  listen_to(other, 6);
  s.graph = picture(states);
  const std::string text((1 << 20) - 100, 'x');
  for (std::uint32_t n = 1; n <= 6; ++n) {
    const TopicKey key{"/t" + std::to_string(n), kType};
    topics.push_back(std::make_unique<LocalTopic>(s.context, key));
    topics.back()->on_graph(ms(0));
    EXPECT_TRUE(topics.back()->offer_to(greedy.link, ms(0)).has_value());
    if (n == 6) {
      EXPECT_TRUE(topics.back()->offer_to(other.link, ms(0)).has_value());
    }
    topics.back()->on_taken(
        {{}, gid(static_cast<std::uint8_t>(n)), flow_test::at_ms(1), sample(text), {}}, ms(0));
  }
  EXPECT_EQ(greedy.link.account->early.used() >> 20, 3U);  // of 4 MiB
  EXPECT_GT(other.link.account->early.used(), 1'000'000U);
}

}  // namespace
}  // namespace connect_bridge::topics_test
