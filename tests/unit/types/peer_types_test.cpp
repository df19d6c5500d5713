// What a side asks its peers about types, as a script.
#include <gmock/gmock.h>

#include "core/types/type_description.hpp"
#include "unit/side/script.hpp"
#include "unit/types/descriptions.hpp"

namespace connect_bridge::side_test {
namespace {

using testing::HasSubstr;
using testing::Not;

const std::string kPeersText = canonical_text(
    description(kType, {field("id", FieldKind::kInt32), field("name", FieldKind::kString)}));
const std::string kOwnText = canonical_text(
    description(kType, {field("id", FieldKind::kInt64), field("name", FieldKind::kString)}));

ChannelOffer typed(std::uint32_t id, const std::string& name, std::uint8_t publisher,
                   const std::string& text = kPeersText) {
  ChannelOffer offer = channel(id, name, {origin(1, publisher)});
  offer.type_hash = type_hash_of(text);
  return offer;
}

// Peer 1 has offered /a of publisher 11 on channel 1: mirror 2, whose type is not installed here.
struct PeerTypes : Script {
  explicit PeerTypes(std::vector<Rule> rules = {everything()}) : Script(server(std::move(rules))) {
    graph({});
    pass(1000);
    session = join(1);
    offer(1, 1, "/a", 11);
    did();
  }
  void offer(std::uint32_t connection, std::uint32_t id, const std::string& name,
             std::uint8_t publisher, const std::string& text = kPeersText) {
    say(connection, Offer{{typed(id, name, publisher, text)}, id == 1});
    pass(1);  // only a few mirrors appear in one step
  }
  // The gateway has not installed the type of this mirror, or has another definition.
  void lacks(std::uint32_t mirror, const std::string& hash_here = "") {
    give(TypeDiffers{{mirror}, hash_here});
  }
  void refuses(std::uint32_t mirror) {
    give(MirrorFailed{{mirror}, "type_mismatch", "other hash", type_hash_of(kOwnText)});
  }
  [[nodiscard]] std::size_t times(const std::string& words) const {
    std::size_t count = 0;
    for (auto i = logged.find(words); i != std::string::npos; i = logged.find(words, i + 1))
      ++count;
    return count;
  }
  // Peer 2 offers the same type for another publisher on its channel 1: mirror 3.
  void join_second() {
    join(2);
    offer(2, 1, "/a", 12);
    did();
  }
  Token128 session;
};

TEST(PeerTypes, ATypeThatIsNotInstalledIsAskedForOnce) {
  PeerTypes s;
  s.lacks(2);
  EXPECT_EQ(s.said(1), "describe 1\n");
  s.offer(1, 2, "/b", 12);
  s.did();
  s.lacks(3);
  EXPECT_EQ(s.said(1), "");
  s.say(1, Description{{1}, kPeersText});
  EXPECT_EQ(s.did(), "describe_type p/msg/T\n");
  // It is told once for all mirrors of the type.
  s.offer(1, 3, "/c", 13);
  s.did();
  s.lacks(4);
  EXPECT_EQ(s.said(1), "");
  EXPECT_EQ(s.did(), "");
}

TEST(PeerTypes, IsNotAskedForWithoutNeed) {
  PeerTypes s;
  EXPECT_EQ(s.said(1), "");
}

TEST(PeerTypes, AnotherPeerIsAskedWhenOneDoesNotKnow) {
  PeerTypes s;
  s.join_second();
  s.lacks(2);
  EXPECT_EQ(s.said(1), "describe 1\n");
  s.say(1, Description{{1}, ""});
  EXPECT_EQ(s.said(2), "describe 1\n");
  s.say(2, Description{{1}, kPeersText});
  EXPECT_EQ(s.did(), "describe_type p/msg/T\n");
}

TEST(PeerTypes, AnotherPeerIsAskedWhenOneIsLost) {
  PeerTypes s;
  s.join(2);
  s.offer(2, 1, "/a", 12);
  s.lacks(2);
  s.said(2);
  s.lose(1);
  EXPECT_THAT(s.said(2), HasSubstr("describe 1\n"));
}

TEST(PeerTypes, IsAskedForAgainAfterABreak) {
  PeerTypes s;
  s.lacks(2);
  s.said(1);
  s.lose(1);
  s.join(3, s.session);
  s.offer(3, 1, "/a", 11);
  EXPECT_THAT(s.said(3), HasSubstr("describe 1\n"));
  s.did();
  s.say(3, Description{{1}, kPeersText});
  EXPECT_EQ(s.did(), "describe_type p/msg/T\n");
}

// The mirror lives on, and what is made of the description with it.
TEST(PeerTypes, WhatIsOfferedAgainAtOnceIsKnownAndCounts) {
  PeerTypes s;
  const auto before = s.status().shared_bytes;
  s.lacks(2);
  s.say(1, Description{{1}, kPeersText});
  s.said(1);
  s.did();
  s.say(1, Withdraw{{{1}}});
  s.offer(1, 2, "/a", 11);
  EXPECT_THAT(s.did(), Not(HasSubstr("mirror ")));
  EXPECT_EQ(s.said(1), "");
  EXPECT_GE(s.status().shared_bytes, before + 4 * kPeersText.size());
  s.say(1, Withdraw{{{2}}});
  s.pass(1000);
  EXPECT_LT(s.status().shared_bytes, before + kPeersText.size());
}

TEST(PeerTypes, ABreakForgetsNothingThatAMirrorHas) {
  PeerTypes s;
  s.lacks(2);
  s.say(1, Description{{1}, kPeersText});
  s.lose(1);
  s.join(3, s.session);
  s.offer(3, 1, "/a", 11);
  EXPECT_THAT(s.said(3), Not(HasSubstr("describe")));
}

TEST(PeerTypes, MemoryIsFreeWhenTheLastChannelIsGone) {
  PeerTypes s;
  s.offer(1, 2, "/b", 12);
  const auto before = s.status().shared_bytes;
  s.lacks(2);
  s.say(1, Description{{1}, kPeersText});
  EXPECT_GE(s.status().shared_bytes, before + kPeersText.size());
  s.say(1, Withdraw{{{1}}});
  EXPECT_GE(s.status().shared_bytes, before + kPeersText.size());
  s.say(1, Withdraw{{{2}}});
  s.pass(1000);
  EXPECT_LT(s.status().shared_bytes, before + kPeersText.size());
}

TEST(PeerTypes, NoMoreThanEightAreAskedForAtATime) {
  PeerTypes s;
  for (std::uint32_t i = 1; i <= 20; ++i) {
    const auto text =
        canonical_text(description(kType, {field("f" + std::to_string(i), FieldKind::kInt8)}));
    s.offer(1, i + 1, "/x" + std::to_string(i), static_cast<std::uint8_t>(20 + i), text);
    s.lacks(i + 2);
  }
  std::string asked;
  for (std::uint32_t i = 2; i <= 9; ++i) asked += "describe " + std::to_string(i) + "\n";
  EXPECT_EQ(s.said(1), asked);
  s.say(1, Description{{5}, ""});
  EXPECT_EQ(s.said(1), "describe 10\n");
  s.say(1, Withdraw{{{6}}});  // it does not wait any longer
  EXPECT_EQ(s.said(1), "describe 11\n");
}

TEST(PeerTypes, AnswersThatBreakTheProtocolEndTheConnection) {
  const auto closes = [](const std::string& told, std::uint32_t channel, bool asked) {
    PeerTypes s;
    if (asked) s.lacks(2);
    s.did();
    s.say(1, Description{{channel}, told});
    return s.did();
  };
  EXPECT_THAT(closes(kOwnText, 1, true),
              HasSubstr("close 1 4002"));  // not what the hash stands for
  EXPECT_THAT(closes(kPeersText, 1, false), HasSubstr("close 1 4009"));
  EXPECT_THAT(closes(kPeersText, 7, true), HasSubstr("close 1 4010"));
}

TEST(PeerTypes, WhatIsRightButUnusableIsNotKnown) {
  PeerTypes s;
  const std::string other = canonical_text(description("q/msg/T", {field("id", FieldKind::kInt8)}));
  s.offer(1, 2, "/b", 12, other);  // as a p/msg/T
  s.did();
  s.lacks(3);
  EXPECT_EQ(s.said(1), "describe 2\n");
  s.say(1, Description{{2}, other});
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.said(1), "");
  s.pass(30'000);  // nor later: the hash stands for this text alone
  EXPECT_EQ(s.said(1), "");
}

TEST(PeerTypes, AMismatchIsOneLineWithTheDifference) {
  PeerTypes s;
  s.refuses(2);
  EXPECT_EQ(s.said(1), "describe 1\ndecline 1 type_mismatch\n");
  EXPECT_EQ(s.did(), "look_up 1 p/msg/T " + type_hash_of(kOwnText) + "\nclaim []\n");
  s.say(1, Description{{1}, kPeersText});
  s.give(TypeLookedUp{{1}, kOwnText});
  s.did();
  EXPECT_THAT(s.logged,
              HasSubstr("cannot mirror /a of /peer_node: the definition of p/msg/T here (" +
                        type_hash_of(kOwnText).substr(0, 15) + "...) is not that of "));
  EXPECT_THAT(s.logged, HasSubstr(": 'id' is int64 here and int32 there. "));
  EXPECT_THAT(s.logged, HasSubstr("allow_type_mismatch"));
  EXPECT_EQ(s.times("cannot mirror"), 1U);
  // Once for the type and the peer's hash.
  s.offer(1, 2, "/b", 12);
  s.refuses(3);
  s.pass(10'000);
  s.did();
  EXPECT_EQ(s.times("cannot mirror"), 1U);
}

TEST(PeerTypes, TheLineDoesNotWaitForever) {
  PeerTypes s;
  s.refuses(2);
  s.give(TypeLookedUp{{1}, kOwnText});
  s.pass(4'000);
  s.did();
  EXPECT_EQ(s.times("cannot mirror"), 0U);
  s.pass(2'000);
  s.did();
  EXPECT_THAT(s.logged, HasSubstr("the peer does not tell its definition"));
  EXPECT_EQ(s.times("cannot mirror"), 1U);
}

TEST(PeerTypes, ARuleMayUseATypeNevertheless) {
  Rule brave = everything();
  brave.treatment.allow_type_mismatch = true;
  PeerTypes s({brave});
  s.lacks(2, type_hash_of(kOwnText));
  EXPECT_EQ(s.said(1), "describe 1\n");
  s.say(1, Description{{1}, kPeersText});
  s.give(TypeLookedUp{{1}, kOwnText});
  s.did();
  EXPECT_THAT(s.logged, HasSubstr("\n/a of /peer_node: the definition of p/msg/T here"));
  EXPECT_THAT(s.logged, HasSubstr("Messages that do not fit"));
}

TEST(PeerTypes, TheMirrorIsMadeWhenTheRuleAllowsIt) {
  PeerTypes s;
  s.refuses(2);
  s.did();
  Rule brave = everything();
  brave.treatment.allow_type_mismatch = true;
  s.give(PolicyChanged{Policy{{brave}}});
  EXPECT_THAT(s.did(), HasSubstr("mirror 3 /a"));
}

TEST(PeerTypes, WhatIsWithdrawnLosesItsPlaceInTheLine) {
  PeerTypes s;
  const auto text = [](std::uint32_t i) {
    return canonical_text(description(kType, {field("f" + std::to_string(i), FieldKind::kInt8)}));
  };
  for (std::uint32_t i = 2; i <= 11; ++i) {
    s.offer(1, i, "/x" + std::to_string(i), static_cast<std::uint8_t>(20 + i), text(i));
    s.lacks(i + 1);
  }
  s.said(1);
  s.say(1, Withdraw{{{10}}});
  s.offer(1, 12, "/y", 40, text(10));
  s.pass(300);
  s.lacks(13);
  s.say(1, Description{{2}, text(2)});
  EXPECT_EQ(s.said(1), "describe 11\n");
}

TEST(PeerTypes, TheLossOfAnotherLinkChangesNothing) {
  PeerTypes s;
  s.join_second();
  s.refuses(2);
  s.give(TypeLookedUp{{1}, kOwnText});
  s.lose(2);
  s.say(1, Description{{1}, kPeersText});
  s.did();
  EXPECT_THAT(s.logged, HasSubstr(": 'id' is int64 here and int32 there. "));
}

TEST(PeerTypes, ASilentPeerDoesNotKeepTheAnswerOfAnother) {
  PeerTypes s;
  s.join(2);
  s.offer(2, 1, "/a", 12);
  s.lacks(2);
  EXPECT_EQ(s.said(1), "describe 1\n");
  s.said(2);
  s.pass(5000);
  EXPECT_EQ(s.said(2), "describe 1\n");
  s.did();
  s.say(1, Description{{1}, kPeersText});  // late, but right
  EXPECT_EQ(s.did(), "describe_type p/msg/T\n");
}

TEST(PeerTypes, WhoDidNotKnowIsAskedTwiceMore) {
  PeerTypes s;
  s.lacks(2);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(s.said(1), "describe 1\n");
    s.say(1, Description{{1}, ""});
    s.pass(9000);
    EXPECT_EQ(s.said(1), "");
    s.pass(1000);
  }
  s.pass(60'000);
  EXPECT_EQ(s.said(1), "");
}

TEST(PeerTypes, ThatWhatDoesNotFitIsDroppedIsToldWhenTheRuleAllowsIt) {
  PeerTypes s;
  s.refuses(2);
  Rule brave = everything();
  brave.treatment.allow_type_mismatch = true;
  s.give(PolicyChanged{Policy{{brave}}});
  s.lacks(3, type_hash_of(kOwnText));
  s.pass(6000);
  s.did();
  EXPECT_THAT(s.logged, HasSubstr("Messages that do not fit"));
}

TEST(PeerTypes, OneIdentitysLinesDoNotAllWait) {
  PeerTypes s;
  for (std::uint32_t i = 2; i <= 40; ++i) {
    s.offer(1, i, "/x" + std::to_string(i), static_cast<std::uint8_t>(20 + i),
            canonical_text(description(kType, {field("f" + std::to_string(i), FieldKind::kInt8)})));
    s.refuses(i + 1);
  }
  s.did();
  EXPECT_EQ(s.times("too many such lines wait for definitions"), 7U);
}

// Two links offer one publisher, and the rule of the second one does not allow another definition.
TEST(PeerTypes, ALinkFeedsByItsOwnRightOnly) {
  Rule brave = everything();
  brave.identities = {"brave"};
  brave.treatment.allow_type_mismatch = true;
  Script s(server({brave, everything()}));
  s.graph({});
  s.pass(1000);
  const auto session = s.login(1, {}, Identity{"brave", {}, 0, ""});
  s.login(2);
  s.did();
  s.say(1, Offer{{typed(1, "/a", 11)}, true});
  EXPECT_THAT(s.did(), HasSubstr("mirror 2 /a"));
  s.say(2, Offer{{typed(1, "/a", 11, kOwnText)}, true});
  EXPECT_EQ(s.did(), "");  // it stands by
  s.lose(1);
  EXPECT_THAT(s.did(), HasSubstr("unmirror 2\nmirror 3 /a"));
  s.give(MirrorFailed{{3}, "type_mismatch", "other hash", type_hash_of(kPeersText)});
  EXPECT_THAT(s.said(2), HasSubstr("decline 1 type_mismatch"));
  s.did();
  s.login(3, session, Identity{"brave", {}, 0, ""});
  s.did();
  s.say(3, Offer{{typed(1, "/a", 11)}, true});
  EXPECT_THAT(s.did(), HasSubstr("mirror 4 /a"));
  EXPECT_THAT(s.said(3), testing::Not(HasSubstr("decline")));
}

}  // namespace
}  // namespace connect_bridge::side_test
