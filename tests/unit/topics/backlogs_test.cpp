// What a topic keeps for lost links, and what becomes of it when they return.
#include "core/topics/backlogs.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "unit/topics/exporting.hpp"

namespace connect_bridge::topics_test {
namespace {

OutSample reliable_sample(const std::string& text, std::vector<LinkId> targets = {}) {
  return {OriginId{1}, flow_test::at_ms(1), 0, sample(text), std::move(targets), true};
}

// /a of publisher 1 is demanded by link 1, for which messages are kept for ten seconds.
struct Keeping {
  explicit Keeping(const Rule& treated = everything()) : s({treated}) {
    s.see(topic("/a").pub(1));
    EXPECT_TRUE(open());
    demand(demand_of(1, true));
  }

  bool open() {
    offer.emplace(s.context, s.subject, peer.link);
    return offer->open().has_value();
  }
  static ChannelDemand demand_of(std::uint16_t number, bool resume,
                                 std::optional<std::uint32_t> after = {}) {
    return {.channel = {1}, .number = number, .resume = resume, .after = after};
  }
  void demand(const ChannelDemand& demand, std::int64_t at = 0) {
    offer->on_demand(demand, ms(at));
  }
  void send(const std::string& text, bool reliable = true) {
    OutSample sent = reliable_sample(text);
    sent.reliable = reliable;
    offer->send(sent, Codec::kNone, sent.raw, ms(0));
  }
  void publish(const std::string& text, std::int64_t at = 0) {
    subject.add(reliable_sample(text), ms(at));
  }
  void lose(std::int64_t at = 0, const std::vector<OutSample>& encoding = {}) {
    subject.begin(*offer, id(), encoding, ms(at));
    offer.reset();
    peer.lose();
  }
  // The link is back. Whether its offer continues the one before.
  bool come_back(std::int64_t at = 0) {
    peer.connect(at);
    const bool opened = open();
    return subject.take_over(*offer, id(), opened, ms(at));
  }
  bool go_on(const ChannelDemand& demanded, std::int64_t at = 0) {
    demand(demanded, at);
    return subject.go_on(*offer, id(), demanded, ms(at));
  }
  // What is sent from this moment on.
  std::string said(std::int64_t from = 0) {
    std::string words;
    for (std::int64_t at = from; at < from + 1000; at += 5) {
      peer.link.sending().on_time(ms(at));
      words += peer.said(at);
    }
    return words;
  }
  [[nodiscard]] TopicStatus kept() const {
    LinkStatus status;
    subject.add_status(id(), status);
    return status.topics.empty() ? TopicStatus{} : status.topics.at(0);
  }
  // What was counted of the topic on connections that are lost.
  [[nodiscard]] TopicStatus past() const {
    TopicStatus counted;
    counted.topic = "/a";
    counted.type = kType;
    counted.exported = true;
    peer.link.add_past(counted);
    return counted;
  }
  [[nodiscard]] LinkId id() const { return peer.link.id; }

  OneLink peer{1, std::make_shared<Account>(), std::chrono::seconds(10)};
  Exporting s;
  std::optional<TopicOffer> offer;
  Backlogs subject{s.context, s.subject.what(), {s.context.timers, &s.subject}};
};

TEST(Backlogs, WhatMayNotHaveArrivedAndWhatIsPublishedMeanwhileComesInItsOrder) {
  Keeping s;
  for (const char* text : {"a", "b"}) s.send(text);
  s.said();
  s.send("c");  // not begun
  s.lose(0, {reliable_sample("d")});
  s.publish("e");
  EXPECT_TRUE(s.subject.contains(s.id()));
  EXPECT_EQ(s.kept().queued, 5U);
  EXPECT_TRUE(s.come_back(100));
  EXPECT_TRUE(s.go_on(s.demand_of(1, true, 1), 100));  // the first has arrived
  EXPECT_EQ(s.said(100), "2.1 b\n2.1 c\n2.1 d\n2.1 e\n");
  EXPECT_TRUE(s.subject.empty());
  EXPECT_EQ(s.past().messages, 1U);
  EXPECT_EQ(s.past().dropped.total(), 0U);
}

TEST(Backlogs, WhatHasNotArrivedWhenTheLinkIsLostAgainIsKeptAgain) {
  Keeping s;
  s.send("a");
  s.lose(0, {reliable_sample("b")});
  s.publish("c");
  EXPECT_TRUE(s.come_back());
  EXPECT_TRUE(s.go_on(s.demand_of(1, true, 0)));
  s.peer.said();  // the first is under way
  s.lose();
  EXPECT_EQ(s.kept().queued, 3U);
  EXPECT_TRUE(s.come_back(100));
  EXPECT_TRUE(s.go_on(s.demand_of(1, true, 1), 100));
  EXPECT_EQ(s.said(100), "3.1 b\n3.1 c\n");
}

TEST(Backlogs, OnlyReliableSamplesAreKept) {
  Keeping s;
  s.send("a");
  s.send("b", false);
  OutSample unreliable = reliable_sample("d");
  unreliable.reliable = false;
  s.lose(0, {reliable_sample("c"), unreliable});
  EXPECT_EQ(s.kept().queued, 2U);
}

// It does not know where it was: what was kept could come twice.
TEST(Backlogs, APeerThatDoesNotSayWhatArrivedGetsNothingAgain) {
  Keeping s;
  s.send("a");
  s.said();
  s.lose();
  s.publish("b");
  EXPECT_TRUE(s.come_back());
  EXPECT_FALSE(s.go_on(s.demand_of(1, true)));
  EXPECT_EQ(s.said(), "");
  EXPECT_TRUE(s.subject.empty());
  EXPECT_EQ(s.past().dropped.of(DropReason::kNoDemand), 2U);
}

TEST(Backlogs, APeerThatWantsNothingKeptOrNothingAtAllGetsNothingAgain) {
  for (const ChannelDemand& demanded : {Keeping::demand_of(1, false, 0), ChannelDemand{}}) {
    Keeping s;
    s.send("a");
    s.lose();
    EXPECT_TRUE(s.come_back());
    EXPECT_FALSE(s.go_on(demanded));
    EXPECT_EQ(s.said(), "");
    EXPECT_FALSE(s.subject.contains(s.id()));
    EXPECT_EQ(s.past().dropped.of(DropReason::kNoDemand), 1U);
    EXPECT_FALSE(s.go_on(s.demand_of(2, true, 0)));  // nor does a later demand find it
  }
}

TEST(Backlogs, EndWhenTheirTimeIsOver) {
  Keeping s;
  s.send("a");
  s.lose(1000);
  EXPECT_FALSE(s.subject.end_overdue(ms(10'999)));
  EXPECT_TRUE(s.subject.contains(s.id()));
  EXPECT_TRUE(s.subject.end_overdue(ms(11'000)));
  EXPECT_TRUE(s.subject.empty());
  EXPECT_FALSE(s.subject.end_overdue(ms(11'000)));
  EXPECT_EQ(s.past().dropped.of(DropReason::kResumeBound), 1U);
}

// The topic is woken, as it may be over with that.
TEST(Backlogs, WakeTheirTopicWhenTheyAreDueAndWhenTheLastHasEnded) {
  Keeping s;
  s.lose(1000);
  EXPECT_EQ(s.s.context.timers.deadline(), ms(11'000).steady);
  EXPECT_TRUE(s.subject.end(s.id(), DropReason::kResumeBound, ms(5000)));
  EXPECT_EQ(s.s.context.timers.deadline(), ms(5000).steady);
  EXPECT_FALSE(s.subject.end(s.id(), DropReason::kResumeBound, ms(5000)));
}

TEST(Backlogs, ALinkThatIsLostAgainHasItsWholeTimeAgain) {
  Keeping s;
  s.send("a");
  s.lose();
  EXPECT_TRUE(s.come_back(8000));
  s.offer.reset();
  s.peer.lose();
  s.subject.renew(s.id(), ms(9000));
  EXPECT_FALSE(s.subject.end_overdue(ms(18'999)));
  EXPECT_TRUE(s.subject.end_overdue(ms(19'000)));
}

// The peer's demand was for another treatment.
TEST(Backlogs, UnderOtherRulesNothingGoesOn) {
  Keeping s;
  s.send("a");
  s.lose();
  EXPECT_TRUE(s.subject.may_stay(s.id()));
  Rule other = everything();
  other.treatment.max_rate = 5;  // followed
  s.s.policy = Policy({other});
  EXPECT_TRUE(s.subject.may_stay(s.id()));
  other.treatment.qos.depth = 5;
  s.s.policy = Policy({other});
  EXPECT_FALSE(s.subject.may_stay(s.id()));
  EXPECT_FALSE(s.come_back());
  EXPECT_TRUE(s.subject.empty());
  EXPECT_FALSE(s.subject.hold({1}));
  s.publish("b");
  s.subject.miss();
  EXPECT_EQ(s.kept().queued, 0U);
  EXPECT_EQ(s.past().dropped.of(DropReason::kWithdrawn), 1U);
  EXPECT_EQ(s.past().dropped.total(), 1U);
  EXPECT_FALSE(s.go_on(s.demand_of(1, true, 0)));
  EXPECT_EQ(s.said(), "");
}

// The topic is woken: whether it is still wanted cannot be judged while it is offered.
TEST(Backlogs, WhatWillNotGoOnEndsAtOnceAndWakesItsTopic) {
  Keeping s;
  s.lose(1000);
  s.s.policy = Policy({rule({"/b"}, {})});
  EXPECT_FALSE(s.come_back(2000));
  EXPECT_TRUE(s.subject.empty());
  EXPECT_EQ(s.s.context.timers.deadline(), ms(2000).steady);
  EXPECT_TRUE(s.subject.end_overdue(ms(2000)));
  EXPECT_FALSE(s.subject.end_overdue(ms(2000)));
}

TEST(Backlogs, OfAnotherDefinitionOfTheTypeNothingGoesOn) {
  const auto of_type = [](const std::string& hash) {
    Topic seen = topic("/a").pub(1);
    seen.type_hash = hash;
    return seen;
  };
  for (const bool changes : {false, true}) {
    Keeping s;
    s.s.see(of_type("RIHS01_1"));
    ASSERT_TRUE(s.open());
    s.demand(s.demand_of(1, true));
    s.send("a");
    s.lose();
    s.s.see(of_type(changes ? "RIHS01_2" : "RIHS01_1"));
    EXPECT_EQ(s.come_back(), !changes);
  }
}

TEST(Backlogs, KeepWhatAnOpenLinkWouldGetAndCountTheRest) {
  Rule slow = everything();
  slow.treatment.max_rate = 1;
  Keeping s(slow);
  s.peer.link.connection()->set_peer_message_bytes_max(10);
  s.lose();
  s.publish("123456", 0);  // 10 bytes with its encapsulation
  s.publish("1234567", 1000);
  s.publish("a", 1000);
  s.publish("b", 1001);
  EXPECT_EQ(s.kept().queued, 2U);
  EXPECT_EQ(s.kept().dropped.of(DropReason::kTooLarge), 1U);
  EXPECT_EQ(s.kept().dropped.of(DropReason::kRate), 1U);
}

TEST(Backlogs, WhatABestEffortSubscriptionTookIsCountedAsLost) {
  Keeping s;
  s.lose();
  s.subject.miss();
  s.subject.miss();
  EXPECT_EQ(s.kept().dropped.of(DropReason::kResumeBound), 2U);
}

TEST(Backlogs, HoldAnOriginAsLongAsAMessageOfItIsKept) {
  Keeping s;
  s.lose();
  EXPECT_FALSE(s.subject.hold({1}));
  s.publish("a");
  EXPECT_TRUE(s.subject.hold({1}));
  EXPECT_FALSE(s.subject.hold({2}));
  EXPECT_TRUE(s.subject.end(s.id(), DropReason::kResumeBound, ms(0)));
  EXPECT_FALSE(s.subject.hold({1}));
}

TEST(Backlogs, ARuleThatWantsItVolatileHoldsWhileTheLinkIsLost) {
  Rule rule = everything();
  rule.treatment.qos.durability = Durability::kVolatile;
  Keeping s(rule);
  EXPECT_FALSE(s.subject.want_volatile());
  s.lose();
  EXPECT_TRUE(s.subject.want_volatile());
  Keeping plain;
  plain.lose();
  EXPECT_FALSE(plain.subject.want_volatile());
}

TEST(Backlogs, OfALinkWithoutOneNothingIsSaid) {
  Keeping s;
  EXPECT_TRUE(s.subject.may_stay(s.id()));
  EXPECT_FALSE(s.subject.take_over(*s.offer, s.id(), true, ms(0)));
  EXPECT_FALSE(s.subject.go_on(*s.offer, s.id(), s.demand_of(1, true, 0), ms(0)));
  LinkStatus status;
  s.subject.add_status(s.id(), status);
  EXPECT_TRUE(status.topics.empty());
}

TEST(Backlogs, AreShownWithTheTopicsOwnCountsAndWithNoOthers) {
  Keeping s;
  s.send("a");
  s.lose();
  LinkStatus status;
  for (const bool exported : {false, true}) {
    TopicStatus& topic = status.topics.emplace_back();
    topic.topic = "/a";
    topic.type = kType;
    topic.exported = exported;
    topic.queued = 10;
  }
  s.subject.add_status(s.id(), status);
  ASSERT_EQ(status.topics.size(), 2U);
  EXPECT_EQ(status.topics.at(0).queued, 10U);
  EXPECT_EQ(status.topics.at(1).queued, 11U);
  EXPECT_FALSE(status.topics.at(0).kept);
  EXPECT_TRUE(status.topics.at(1).kept);
}

// Topics of one link are one line, when the last of them is decided.
TEST(Backlogs, OneLineSaysWhatABreakHasLost) {
  Keeping s;
  s.s.graph = picture({topic("/a").pub(1), topic("/b").pub(2)});
  LocalTopic other(s.s.context, {"/b", kType});
  other.on_graph(ms(0));
  TopicOffer its_offer(s.s.context, other, s.peer.link);
  ASSERT_TRUE(its_offer.open());
  its_offer.on_demand(Keeping::demand_of(1, true), ms(0));
  Backlogs its(s.s.context, other.what(), {s.s.context.timers, &other});
  its.begin(its_offer, s.id(), {reliable_sample("x"), reliable_sample("y")}, ms(0));
  s.lose(0, {reliable_sample("z")});
  s.s.did();
  EXPECT_TRUE(its.end(s.id(), DropReason::kWithdrawn, ms(0)));
  s.s.did();
  EXPECT_EQ(s.s.logged, "");
  EXPECT_TRUE(s.come_back());
  EXPECT_TRUE(s.go_on(s.demand_of(1, true, 0)));
  s.s.did();
  EXPECT_EQ(s.s.logged,
            "after the break of the link with /peer at 10.0.0.1 1 messages come late, "
            "2 are lost\n");
  EXPECT_TRUE(s.s.context.kept.empty());
}

TEST(Backlogs, ABreakThatCostNothingIsNoLine) {
  Keeping s;
  s.lose();
  EXPECT_TRUE(s.subject.end(s.id(), DropReason::kResumeBound, ms(0)));
  s.s.did();
  EXPECT_EQ(s.s.logged, "");
}

}  // namespace
}  // namespace connect_bridge::topics_test
