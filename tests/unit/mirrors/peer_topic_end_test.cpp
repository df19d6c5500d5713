#include <gtest/gtest.h>

#include <string>

#include "core/mirrors/peer_topic.hpp"
#include "unit/mirrors/peer_topic_script.hpp"

namespace connect_bridge::topics_test {
namespace {

// `ros2 topic pub --once` ends right after its message, which a worker may still have.
TEST(PeerTopic, WhatAWorkerHasIsPublishedBeforeTheTopicIsWithdrawn) {
  OfferedScript s;
  s.listen();
  s.offer(s.peer, {origin(1, 7)});
  const std::string map(2000, 'm');
  s.give(s.large(map));
  s.give(s.message("small"));
  s.did();
  s.channel_1().on_withdraw({}, ms(0));
  EXPECT_FALSE(s.one.link.incoming({1})->channel);
  EXPECT_EQ(s.peer.decoding().used(), 0U);
  EXPECT_EQ(s.did(), "cancel 1\npublish 1 " + map + "\npublish 1 small\n");
  s.finish(sample("late"));
  EXPECT_EQ(s.did(), "");
}

TEST(PeerTopic, WhatAWorkerHasIsPublishedBeforeItsOriginLeaves) {
  OfferedScript s;
  s.listen();
  s.offer(s.peer, {origin(1, 7), origin(2, 8)});
  const std::string map(2000, 'm');
  s.give(s.large(map));
  s.did();
  EXPECT_TRUE(s.channel_1().on_origins({{1}, {}, {{2}}}, ms(0)));
  EXPECT_EQ(s.did(), "");  // it is of the other one
  EXPECT_TRUE(s.channel_1().on_origins({{1}, {}, {{1}}}, ms(0)));
  EXPECT_EQ(s.did(), "cancel 1\npublish 1 " + map + "\n");
}

TEST(PeerTopic, WhatAWorkerHasOfOthersStaysWithIt) {
  OfferedScript s;
  s.listen();
  s.offer(s.peer, {origin(1, 7), origin(2, 8)});
  s.give(s.large());
  InMessage other = s.message("other");
  other.subject = Subject(OriginId{2});
  s.give(std::move(other));
  s.did();
  EXPECT_TRUE(s.channel_1().on_origins({{1}, {}, {{2}}}, ms(0)));
  EXPECT_EQ(s.did(), "publish 2 other\n");
  s.finish(sample("large"));
  EXPECT_EQ(s.did(), "publish 1 large\n");
}

// Its channel ends in a later step, if the link has told much.
TEST(PeerTopic, WhatAWorkerHasIsNotPublishedAfterTheConnection) {
  OfferedScript s;
  s.listen();
  s.offer(s.peer, {origin(1, 7)});
  s.give(s.large());
  s.did();
  s.peer.finish(ms(0));
  s.finish(sample("large"));
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.dropped(DropReason::kLinkLost), 1U);
}

TEST(PeerTopic, OnlySoManyThatARateHoldsArePublishedBeforeAWithdraw) {
  Rule limited = everything();
  limited.treatment.max_rate = 1;
  OfferedScript s;
  s.policy = Policy({limited});
  s.listen();
  std::size_t published = 0;
  const auto come_and_go = [&](std::int64_t at) {
    s.offer(s.peer, {origin(1, 7)}, at);
    s.give(s.message("x"), at);
    s.channel_1().on_withdraw({}, ms(at));
    published += s.did().find("publish") != std::string::npos ? 1 : 0;
  };
  for (int i = 0; i < 1100; ++i) come_and_go(0);
  EXPECT_EQ(published, 1 + 1024U);  // the rate's first
  come_and_go(1);
  EXPECT_EQ(published, 2 + 1024U);
}

// The loop does not stand still for a peer that offers and withdraws.
TEST(PeerTopic, OnlySoMuchIsPublishedBeforeAWithdraw) {
  OfferedScript s;
  s.listen();
  std::uint64_t published = 0;
  const std::string picture(1 << 20, 'x');
  for (int i = 0; i < 40; ++i) {
    s.offer(s.peer, {origin(1, 7)});
    s.give(s.large(picture));
    s.did();
    s.channel_1().on_withdraw({}, ms(0));
    published += s.did().find("publish") != std::string::npos;
  }
  EXPECT_EQ(published, 15U);
}

}  // namespace
}  // namespace connect_bridge::topics_test
