// One interface of ours on one link.
#include "core/offers/link_offer.hpp"

#include <gtest/gtest.h>

#include "unit/topics/one_link.hpp"

namespace connect_bridge::topics_test {
namespace {

struct NoChannel final : OutgoingChannel {};

// /a is offered to peer 1.
struct Offered : Actions {
  explicit Offered(const Rule& rule = everything(),
                   LinkOffer::Terms terms = LinkOffer::Terms::kFixed)
      : subject(
            side, peer.link,
            std::make_shared<LocalInterface>(LocalInterface{InterfaceKind::kTopic, {"/a", kType}}),
            terms) {
    policy = Policy({rule});
  }

  std::optional<ChannelOffer> open() { return subject.open(channel); }
  void accept(std::vector<std::string> topics) {
    peer.link.accepts.adopt(Accepts{{{std::move(topics), {}}}, {}});
  }
  // Why it ends; empty: it stays.
  std::string review(bool used) {
    const auto why = subject.review(used);
    return why ? why->reason : "";
  }
  void decline() { subject.on_decline({subject.number(), "failed", "no room"}, ms(0)); }
  // The events of the audit log since the last call, with the rule.
  std::string audited() {
    std::string lines;
    while (const auto action = outputs.next())
      if (const auto* line = std::get_if<Audit>(&*action)) lines += word_of(*line) + "\n";
    return lines;
  }

  OneLink peer;
  NoChannel channel;
  LinkOffer subject;
};

TEST(LinkOffer, OpensAChannelForWhatThePeerMayHave) {
  Offered s;
  EXPECT_TRUE(s.subject.is_due());
  const auto offer = s.open();
  ASSERT_TRUE(offer);
  EXPECT_EQ(offer->name, "/a");
  EXPECT_EQ(s.peer.link.outgoing(offer->channel), &s.channel);
  EXPECT_FALSE(s.subject.is_due());
  EXPECT_EQ(s.review(false), "");
}

TEST(LinkOffer, AnAnswerThatIsNoHoldsUntilAReview) {
  Offered s(rule({"/b"}, {}));
  EXPECT_FALSE(s.open());
  EXPECT_FALSE(s.subject.is_due());
  EXPECT_EQ(s.review(false), "no rule allows exporting it any longer");
  EXPECT_TRUE(s.subject.is_due());
}

TEST(LinkOffer, EndsWithItsRightAndSaysWhy) {
  Offered s;
  ASSERT_TRUE(s.open());
  s.accept({"/b"});
  EXPECT_EQ(s.review(true), "the peer does not accept it any longer");
  s.policy = Policy();
  EXPECT_EQ(s.review(true), "no rule allows exporting it any longer");
  s.subject.close(*s.subject.review(true));
  EXPECT_EQ(s.peer.said(), "withdraw 1 not_permitted\n");
  EXPECT_EQ(s.peer.link.outgoing({1}), nullptr);
}

TEST(LinkOffer, ItsOwnerDecidesWhetherNewTermsAreFollowed) {
  for (const auto terms : {LinkOffer::Terms::kFixed, LinkOffer::Terms::kFollowed}) {
    Offered s(everything(), terms);
    ASSERT_TRUE(s.open());
    Rule deeper = everything();
    deeper.treatment.qos.depth = 7;
    s.policy = Policy({deeper});
    const bool follows = terms == LinkOffer::Terms::kFollowed;
    EXPECT_EQ(s.review(true), follows ? "" : "it is to be offered again");
    EXPECT_EQ(s.subject.treatment().qos.depth.value_or(0), follows ? 7U : 0U);
  }
}

TEST(LinkOffer, KeysThatAreNotOfferedAreFollowed) {
  Offered s(everything(), LinkOffer::Terms::kFixed);
  ASSERT_TRUE(s.open());
  Rule slower = everything();
  slower.treatment.max_rate = 1;
  slower.treatment.max_age = std::chrono::seconds(1);
  s.policy = Policy({slower});
  EXPECT_EQ(s.review(true), "");
  EXPECT_EQ(s.subject.treatment().max_rate, 1);
}

TEST(LinkOffer, WhatWasDeclinedIsOfferedAgainUnderAnotherList) {
  Offered s;
  ASSERT_TRUE(s.open());
  s.decline();
  EXPECT_EQ(s.subject.declined().reason, "no room");
  EXPECT_EQ(s.subject.declined().code, "failed");
  EXPECT_EQ(s.review(false), "");
  s.accept({"/a"});
  EXPECT_EQ(s.review(true), "");  // the peer uses it, so it knows it
  EXPECT_EQ(s.review(false), "it is to be offered again");
  s.subject.on_taken();
  EXPECT_EQ(s.review(false), "");
}

TEST(LinkOffer, ALostConnectionEndsTheChannelAndAsksAgain) {
  Offered s;
  ASSERT_TRUE(s.open());
  s.decline();
  s.subject.lose();
  s.peer.lose();
  EXPECT_FALSE(s.subject.is_open());
  EXPECT_EQ(s.review(false), "");  // what the peer accepts is not known
  s.peer.connect();
  ASSERT_TRUE(s.open());
  s.accept({"/a"});
  EXPECT_EQ(s.review(false), "");
}

TEST(LinkOffer, TheAuditLogHasItsRule) {
  Offered s;
  s.outputs.set_audits(true);
  ASSERT_TRUE(s.open());
  EXPECT_NE(s.audited().find("/a"), std::string::npos);
  s.subject.close({"why"});
  EXPECT_NE(s.audited().find("why"), std::string::npos);
  s.subject.close({"why"});
  EXPECT_EQ(s.audited(), "");
}

TEST(LinkOffer, GivesBackItsChannel) {
  OneLink peer;
  {
    Offered s;
    LinkOffer other(
        s.side, peer.link,
        std::make_shared<LocalInterface>(LocalInterface{InterfaceKind::kTopic, {"/a", kType}}),
        LinkOffer::Terms::kFixed);
    ASSERT_TRUE(other.open(s.channel));
    EXPECT_NE(peer.link.outgoing({1}), nullptr);
  }
  EXPECT_EQ(peer.link.outgoing({1}), nullptr);
}

}  // namespace
}  // namespace connect_bridge::topics_test
