// Connections that were refused before a login, in a line of the log now and then.
#include "net/websocket/refusals.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "unit/net/websocket/harness.hpp"

namespace connect_bridge::test {
namespace {

using testing::Contains;
using testing::Each;
using testing::HasSubstr;
using testing::Not;

TimePoint after(std::chrono::minutes time) {
  return TimePoint{} + time;
}

TEST(Refusals, AreToldEveryTenMinutesIfThereAreNewOnes) {
  Refusals refusals;
  EXPECT_FALSE(refusals.take_line(after(0min)));
  refusals.add("127.0.0.1:51234", "no complete request in time");
  EXPECT_EQ(refusals.take_line(after(1min)),
            "a connection was refused before a login, from 127.0.0.1: no complete request in time");
  for (int i = 0; i < 46; ++i) refusals.add("127.0.0.1:51235", "TLS: it does not trust us");
  EXPECT_FALSE(refusals.take_line(after(10min)));
  EXPECT_EQ(refusals.take_line(after(11min)),
            "46 connections were refused before a login; the last, from 127.0.0.1: TLS: it does "
            "not trust us");
  EXPECT_FALSE(refusals.take_line(after(60min)));
}

TEST(Refusals, NameTheAddressWithoutItsPort) {
  for (const auto& [peer, host] :
       {std::pair{"[2001:db8::1]:443", "[2001:db8::1]"},
        std::pair{"[2001:db8::1]", "[2001:db8::1]"}, std::pair{"192.0.2.1", "192.0.2.1"}}) {
    Refusals refusals;
    refusals.add(peer, "why");
    EXPECT_THAT(refusals.take_line(after(0min)).value_or(""),
                HasSubstr(std::string{"from "} + host + ": why"));
  }
}

// A scanner at the door, and what it says.
TEST(Refusals, WhatAStrangerHasSentIsTextThere) {
  Pair pair;
  RawPeer peer(pair.server.network.listen_port());
  const std::string odd =
      "a\xe2\x80\xa8[ERROR] forged\xe2\x80\xae\xc2\x9b"
      "b";
  peer.send(upgrade_request("", "/", odd));
  ASSERT_TRUE(peer.ends(pair.loop));
  ASSERT_TRUE(pair.loop.until([&] { return pair.server.network.counts().refused == 1; }));
  pair.server.network.every_second({});
  EXPECT_THAT(pair.server.logs,
              Contains(HasSubstr("a connection was refused before a login, from 127.0.0.1: HTTP "
                                 "400: This is a ROS2 Connect server.")));
  EXPECT_THAT(pair.server.logs, Contains(HasSubstr("[ERROR] forged")));
  for (const char* bytes : {"\xe2\x80\xa8", "\xe2\x80\xae", "\xc2\x9b"})
    EXPECT_THAT(pair.server.logs, Each(Not(HasSubstr(bytes))));
}

TEST(Refusals, ALineIsOneLine) {
  Pair pair;
  RawPeer peer(pair.server.network.listen_port());
  peer.send("GET / HTTP/1.1\r\nHost: robot\r\n\r\n");
  ASSERT_TRUE(peer.ends(pair.loop));
  EXPECT_THAT(peer.text, HasSubstr("ros2 run connect_bridge client"));
  ASSERT_TRUE(pair.loop.until([&] { return pair.server.network.counts().refused == 1; }));
  pair.server.network.every_second({});
  EXPECT_THAT(pair.server.logs, Contains(HasSubstr("HTTP 426: This is a ROS2 Connect server.")));
  EXPECT_THAT(pair.server.logs, Each(Not(HasSubstr("ros2 run"))));
}

}  // namespace
}  // namespace connect_bridge::test
