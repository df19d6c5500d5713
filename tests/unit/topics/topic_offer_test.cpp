#include "core/topics/topic_offer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "unit/topics/exporting.hpp"

namespace connect_bridge::topics_test {
namespace {

Payload bytes(std::size_t size) {
  return Payload::adopt(Bytes(size));
}

struct Offering : Exporting {
  explicit Offering(const Rule& rule = everything()) : Exporting({rule}) {
    see(topic("/a").pub(1, qos(5)));
    did();
  }
  std::uint64_t dropped(DropReason reason) const {
    LinkStatus status;
    offer.add_status(status);
    return status.topics.at(0).dropped.of(reason);
  }
  OneLink peer;
  TopicOffer offer{context, subject, peer.link};
};

TEST(TopicOffer, OpensAChannelForWhatThePeerMayHave) {
  Offering s;
  const auto offered = s.offer.open();
  ASSERT_TRUE(offered);
  EXPECT_EQ(offered->name, "/a");
  EXPECT_EQ(offered->origins.size(), 1U);
  EXPECT_EQ(s.peer.link.outgoing(offered->channel), &s.offer);
  EXPECT_TRUE(s.offer.is_current());
}

// What it said is kept nowhere.
TEST(TopicOffer, ARuleMakesNoVolatilePublisherLatched) {
  auto latching = everything();
  latching.treatment.qos.durability = Durability::kTransientLocal;
  Offering s(latching);
  const auto offered = s.offer.open();
  ASSERT_TRUE(offered);
  EXPECT_EQ(offered->origins.at(0).qos.durability, Durability::kVolatile);
}

TEST(TopicOffer, WithoutARightThereIsNone) {
  Offering s(rule({"/b"}, {"/**"}));
  EXPECT_FALSE(s.offer.open());
  EXPECT_FALSE(s.offer.is_open());
  s.offer.withdraw({});
  EXPECT_EQ(s.peer.said(), "");
}

TEST(TopicOffer, NewRulesOrAcceptsMakeItStale) {
  Offering s;
  ASSERT_TRUE(s.offer.open());
  s.peer.link.accepts.adopt(Accepts{{{{"/b"}, {}}}, {}});
  EXPECT_FALSE(s.offer.is_current());
  s.offer.withdraw_outdated();
  EXPECT_EQ(s.peer.said(), "withdraw 1\n");
  EXPECT_EQ(s.peer.link.outgoing({1}), nullptr);
}

// Their sum is beyond 32 bits.
TEST(TopicOffer, DepthsOfTheGraphDoNotOverflow) {
  OneLink peer;
  Exporting s;
  Topic deep = topic("/a");
  for (std::uint8_t n = 1; n <= 4; ++n) deep.pub(n, latched(1U << 30));
  s.see(deep);
  ASSERT_TRUE(s.offer(peer));
  Exporting::demand(peer);
  for (int i = 0; i < 150; ++i) s.take(1, "x", i);
  LinkStatus status;
  s.subject.add_status(peer.link.id, status);
  EXPECT_EQ(status.topics.at(0).queued, 150U);
}

TEST(TopicOffer, TellsOfOriginsThatComeAndGo) {
  Offering s;
  ASSERT_TRUE(s.offer.open());
  s.see(topic("/a").pub(1).pub(2));
  s.offer.add_origins({gid(2)});
  s.offer.remove_origins({{1}});
  EXPECT_EQ(s.peer.said(), "origins 1 +[2] -[]\norigins 1 +[] -[1]\n");
}

TEST(TopicOffer, TakesNothingWithoutDemand) {
  Offering s;
  ASSERT_TRUE(s.offer.open());
  EXPECT_FALSE(s.offer.admit({1}, bytes(10), TopicOffer::Age::kNew, ms(0)));
  s.offer.send({{1}, 0, 0, sample("late"), {}}, Codec::kNone, sample("late"), ms(0));
  EXPECT_EQ(s.dropped(DropReason::kNoDemand), 1U);
}

TEST(TopicOffer, CountsWhatItsRateForbids) {
  Rule limited = everything();
  limited.treatment.max_rate = 1;
  Offering s(limited);
  ASSERT_TRUE(s.offer.open());
  s.offer.on_demand({1}, ms(0));
  EXPECT_TRUE(s.offer.admit({1}, bytes(10), TopicOffer::Age::kNew, ms(0)));
  EXPECT_FALSE(s.offer.admit({1}, bytes(10), TopicOffer::Age::kNew, ms(10)));
  EXPECT_EQ(s.dropped(DropReason::kRate), 1U);
  EXPECT_TRUE(s.offer.admit({1}, bytes(10), TopicOffer::Age::kKept, ms(10)));
}

TEST(TopicOffer, CountsWhatIsTooLargeForThePeer) {
  Offering s;
  s.peer.link.connection()->set_peer_message_bytes_max(100);
  ASSERT_TRUE(s.offer.open());
  s.offer.on_demand({1}, ms(0));
  EXPECT_FALSE(s.offer.admit({1}, bytes(101), TopicOffer::Age::kNew, ms(0)));
  EXPECT_FALSE(s.offer.admit({1}, bytes(102), TopicOffer::Age::kNew, ms(0)));
  EXPECT_FALSE(s.offer.admit({1}, bytes(103), TopicOffer::Age::kKept, ms(0)));
  EXPECT_EQ(s.dropped(DropReason::kTooLarge), 3U);
  s.did();
  EXPECT_EQ(
      s.logged,
      "a message of 101 bytes on /a is larger than the max_message_size of /peer at 10.0.0.1; "
      "such messages are dropped\n");
}

// A peer that accepts a topic no longer, and then again, has another offer of it.
TEST(TopicOffer, OfWhatIsTooLargeAnIdentityHasOneLine) {
  const auto account = std::make_shared<Account>();
  OneLink first(1, account), second(2, account), other(3);
  Offering s;
  const auto drop_one = [&](Link& link) {
    link.connection()->set_peer_message_bytes_max(100);
    TopicOffer again(s.context, s.subject, link);
    ASSERT_TRUE(again.open());
    again.on_demand({1}, ms(0));
    EXPECT_FALSE(again.admit({1}, bytes(101), TopicOffer::Age::kNew, ms(0)));
  };
  for (OneLink* peer : {&first, &first, &second, &other}) drop_one(peer->link);
  s.did();
  EXPECT_EQ(std::count(s.logged.begin(), s.logged.end(), '\n'), 2) << s.logged;
}

}  // namespace
}  // namespace connect_bridge::topics_test
