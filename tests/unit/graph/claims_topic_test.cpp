#include "core/graph/claims_topic.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

using namespace std::chrono_literals;

struct TopicScript {
  explicit TopicScript(Duration dead_after = 3s) : topic(claims, dead_after, outputs) { said(); }
  // What is published now, if it is due.
  std::optional<Claim> said() {
    std::optional<Claim> claim;
    while (const auto action = outputs.next())
      if (const auto* publish = std::get_if<Publish>(&*action))
        claim = parse_claim(publish->payload.view());
    return claim;
  }
  std::optional<Claim> said_at(Duration at, std::size_t origins = 0) {
    const Now now{TimePoint{} + at, 0};
    if (!topic.take_due(now)) return std::nullopt;
    topic.publish({side(1), std::vector<Gid>(origins)}, now);
    return said();
  }
  static Token128 side(std::uint8_t n) {
    Token128 id;
    id.bytes.fill(n);
    return id;
  }

  Outputs outputs;
  Claims claims{side(1)};
  ClaimsTopic topic;
};

TEST(ClaimsTopic, AClaimIsGoodForThreeSignsOfLife) {
  TopicScript t;
  t.topic.change();
  EXPECT_EQ(t.said_at(10s)->good_for, 9s);
  EXPECT_FALSE(t.said_at(12s));
  EXPECT_TRUE(t.said_at(13s));
}

// A bridge that fell silent may serve calls until its peer knows that the link is dead.
TEST(ClaimsTopic, AndForLongerThanALinkLives) {
  TopicScript t;
  t.claims.update({}, {TopicScript::side(2), {}}, TimePoint{});
  t.topic.change();
  EXPECT_EQ(t.said_at(10s)->good_for, 4s);
  EXPECT_TRUE(t.said_at(11s));
  TopicScript patient(10s);
  patient.claims.update({}, {TopicScript::side(2), {}}, TimePoint{});
  patient.topic.change();
  EXPECT_EQ(patient.said_at(10s)->good_for, 11s);
}

// How large it is decides how often it is told, and that for how long it is good.
TEST(ClaimsTopic, ALargeClaimIsGoodForLongerFromTheFirst) {
  TopicScript t;
  t.claims.update({}, {TopicScript::side(2), {}}, TimePoint{});
  t.topic.change();
  EXPECT_EQ(t.said_at(10s, 10'000)->good_for, 33s);
  EXPECT_FALSE(t.said_at(20s, 10'000));
  EXPECT_EQ(t.said_at(21s, 1)->good_for, 4s);
  EXPECT_TRUE(t.said_at(22s, 1));
}

// Otherwise thousands of mirrors, made one after the other, would each cost a claim of all of them.
TEST(ClaimsTopic, ALargeClaimLeavesTimeBeforeItsChange) {
  TopicScript t;
  t.topic.change();
  EXPECT_TRUE(t.said_at(10s, 10'000));
  t.topic.change();
  EXPECT_FALSE(t.said_at(10s + 399ms, 10'001));
  EXPECT_EQ(t.topic.deadline(), TimePoint{} + 10s + 400ms);
  EXPECT_TRUE(t.said_at(10s + 400ms, 10));
  t.topic.change();
  EXPECT_TRUE(t.said_at(10s + 401ms, 10'000));
  t.claims.update({}, {TopicScript::side(2), {}}, TimePoint{} + 10s);
  t.topic.change();
  EXPECT_FALSE(t.said_at(10s + 500ms, 10'001));
  EXPECT_TRUE(t.said_at(10s + 501ms, 10'001));
}

// What was said to last is kept to, though the other bridge that made it short has gone.
TEST(ClaimsTopic, ASignOfLifeComesInTimeForTheLastOne) {
  TopicScript t;
  t.claims.update({}, {TopicScript::side(2), {}}, TimePoint{});
  t.topic.change();
  EXPECT_EQ(t.said_at(10s)->good_for, 4s);
  Claim last{TopicScript::side(2), {}};
  last.good_for = 0s;
  t.claims.update({}, last, TimePoint{});
  EXPECT_EQ(t.said_at(11s)->good_for, 9s);
}

}  // namespace
}  // namespace connect_bridge
