// What strangers and peers may try at a side: others do not notice.
#include <gtest/gtest.h>

#include <algorithm>

#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

// Each of them can be made by anybody, as often as they like.
TEST(Side, RefusedStrangersWriteALineNowAndThen) {
  Script s(server());
  s.give(TimePassed{});
  s.did();
  for (std::uint32_t stranger = 1; stranger <= 1000; ++stranger) {
    s.give(ConnectionOpened{{stranger}, "10.0.0.4"});
    s.binary(stranger, {1, 2, 3});
  }
  s.did();
  EXPECT_EQ(std::count(s.logged.begin(), s.logged.end(), '\n'), 1);
  s.pass(10'000);
  s.give(ConnectionOpened{{1001}, "10.0.0.4"});
  s.binary(1001, {1, 2, 3});
  s.did();
  EXPECT_NE(s.logged.find("1000 refused since the last line"), std::string::npos) << s.logged;
}

TEST(Side, WhatAPeerSaysAtTheEndIsTextInTheLog) {
  Script s(server());
  s.join(1);
  s.did();
  s.give(ConnectionClosed{{1}, 1000, "bye\n[ERROR] forged\x1b[2J"});
  s.did();
  EXPECT_NE(s.logged.find("bye?[ERROR] forged?[2J"), std::string::npos) << s.logged;
}

// The first line of an answer that is no WebSocket's, for example.
TEST(Side, WhatAServerAnswersIsTextInTheLog) {
  Script s(client());
  s.give(TimePassed{});
  s.did();
  s.give(
      DialFailed{{1}, {Cause::kProxyWithoutServer, "HTTP 502: \x1b[2J\n[ERROR] forged\xc2\x9b"}});
  s.did();
  EXPECT_NE(s.logged.find("HTTP 502: ?[2J?[ERROR] forged?"), std::string::npos) << s.logged;
  EXPECT_EQ(s.logged.find("\xc2\x9b"), std::string::npos);
}

// Nobody has a right to that channel, and its message is never finished.
TEST(Side, BodiesOfADeclinedChannelTakeNoMemory) {
  Script s(server());
  s.join(1);
  s.say(1, Offer{{channel(1, "/forbidden", {origin(1, 7)})}, true});
  MessageFrame frame;
  frame.channel = {1};
  frame.subject = {1};
  frame.sequence = 1;
  frame.raw_bytes = frame.body_bytes = 64 << 20;
  const Bytes part(100'000);
  frame.part = part;
  Bytes packet;
  append_header(frame, packet);
  packet.insert(packet.end(), part.begin(), part.end());
  s.binary(1, packet);
  EXPECT_TRUE(s.status().links.at(0).open);
  EXPECT_EQ(s.status().memory_bytes, 0U);
}

TEST(Side, OneIdentityDoesNotTakeAllPlaces) {
  auto options = server();
  options.links_max = 5;
  options.identity_links_max = 2;
  Script s(options);
  const Identity anna{"anna", {}, 0};
  s.login(1, {}, anna);
  s.login(2, {}, anna);
  s.did();
  s.login(3, {}, anna);
  EXPECT_EQ(s.did(), "authenticate 3 none\nclose 3 4012\n");
  s.lose(1);  // it waits for its client, but another one is here
  s.did();
  s.login(4, {}, anna);
  EXPECT_NE(s.did().find("gate 4\n"), std::string::npos);
  EXPECT_EQ(s.status().links.size(), 2U);
  s.login(5, {}, {"bert", {}, 0});
  EXPECT_NE(s.did().find("gate 5\n"), std::string::npos);
  for (std::uint32_t i = 6; i <= 7; ++i) s.login(i);  // nobody in particular
  EXPECT_EQ(s.status().links.size(), 5U);
}

// What a peer accepts is compared with everything that is offered: it may change that often, but is
// looked at only as often as is cheap.
TEST(Side, AcceptsInAFloodAreTakenNowAndThenAndTheLastOneHolds) {
  Script s(server());
  s.graph({topic("/a").pub(1)});
  s.join(1);
  std::string said;
  for (int i = 0; i < 1000; ++i) {
    s.say(1, Accepts{{{{i % 2 == 0 ? "/b" : "/a"}, {}}}, {}});
    said += s.said(1);
  }
  EXPECT_LE(std::count(said.begin(), said.end(), '\n'), 40);
  s.say(1, Accepts{{{{"/b"}, {}}}, {}});
  s.pass(20'000);
  said += s.said(1);
  const auto last_offer = said.rfind("offer");
  const auto last_withdraw = said.rfind("withdraw");
  EXPECT_TRUE(last_offer == std::string::npos || last_withdraw > last_offer);
  s.say(1, Accepts{{{{"/a"}, {}}}, {}});
  EXPECT_NE(s.said(1).find("offer"), std::string::npos);  // it is taken at once again
}

// A peer takes 4096 channels; one more would end the link, again and again.
TEST(Side, OffersNoMoreThanAPeerTakes) {
  Script s(server());
  std::vector<Topic> topics;
  for (int i = 0; i < 5000; ++i) topics.push_back(topic("/t" + std::to_string(i)).pub(1));
  s.graph(topics);
  s.login(1);
  s.did();
  s.say(1, Accepts{{{{"/**"}, {}}}, {}});
  s.pass(1);
  const std::string said = s.said(1);
  EXPECT_EQ(times(said, "/t"), 4096);
  s.did();
  EXPECT_NE(s.logged.find("not all interfaces of this side are offered to /peer"),
            std::string::npos);
}

// All that a large graph has waits at once when a link opens: no reason to end it.
TEST(Side, OffersALargeGraphInOnePiece) {
  Script s(server());
  std::vector<Topic> topics;
  const std::string node = "/" + std::string(200, 'n');
  for (int i = 0; i < 4096; ++i) {
    topics.push_back(topic("/t" + std::to_string(i)));
    for (std::uint8_t publisher = 1; publisher < 6; ++publisher)
      topics.back().pub(publisher, {}, node);
  }
  s.graph(topics);
  s.login(1);
  s.did();
  s.say(1, Accepts{{{{"/**"}, {}}}, {}});
  EXPECT_EQ(s.did().find("close"), std::string::npos);
  EXPECT_TRUE(s.status().links.at(0).open);
}

}  // namespace
}  // namespace connect_bridge::side_test
