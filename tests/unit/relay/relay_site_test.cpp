#include "relay/relay_site.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "unit/net/websocket/harness.hpp"

namespace connect_bridge::test {
namespace {

struct AtSite {
  AtSite()
      : site(
            loop.io,
            [this] {
              ++made;
              RelayStatus status;
              status.robots = {{"robot7", "203.0.113.5:4711", {}, {}}};
              return status;
            },
            [](LogLevel, const std::string&) {}) {
    EXPECT_EQ(site.open({"127.0.0.1", 0, {}, false}), "");
  }
  std::string ask(const std::string& path) {
    RawPeer peer(site.port());
    peer.send("GET " + path + " HTTP/1.1\r\nHost: localhost\r\n\r\n");
    EXPECT_TRUE(peer.ends(loop));
    return peer.text;
  }

  Loop loop;
  int made = 0;
  RelaySite site;
};

TEST(RelaySite, AnswersWhatAServersStatusDoes) {
  AtSite at;
  EXPECT_THAT(at.ask("/api/status"), testing::HasSubstr("\"role\": \"relay\""));
  EXPECT_THAT(at.ask("/metrics"), testing::HasSubstr("connect_bridge_robots 1"));
  EXPECT_THAT(at.ask("/healthz"), testing::HasSubstr("alive"));
  EXPECT_THAT(at.ask("/readyz"), testing::HasSubstr("ready"));
  EXPECT_THAT(at.ask("/"), testing::StartsWith("HTTP/1.1 404"));
}

// It is the relay's thread, and every local user may ask.
TEST(RelaySite, MakesItsTextsOnceASecondAndNamesNoAddressesToOtherUsers) {
  AtSite at;
  for (const char* path : {"/api/status", "/api/status", "/metrics"}) {
    const std::string told = at.ask(path);
    EXPECT_THAT(told, testing::HasSubstr("robot7"));
    EXPECT_THAT(told, testing::Not(testing::HasSubstr("203.0.113.5")));
  }
  EXPECT_EQ(at.made, 1);
  at.site.tell();
  at.ask("/api/status");
  EXPECT_EQ(at.made, 2);
}

TEST(RelaySite, TellsThoseWhoFollow) {
  AtSite at;
  RawPeer peer(at.site.port());
  peer.send("GET /api/events HTTP/1.1\r\nHost: localhost\r\n\r\n");
  ASSERT_TRUE(peer.sees(at.loop, "data: {"));
  const std::size_t first = peer.text.size();
  EXPECT_TRUE(at.loop.until([&] {
    at.site.tell();
    peer.poll();
    return peer.text.size() > first;
  }));
}

}  // namespace
}  // namespace connect_bridge::test
