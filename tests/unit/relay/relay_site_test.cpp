#include "relay/relay_site.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "unit/net/harness.hpp"

namespace connect_bridge::test {
namespace {

struct AtSite {
  AtSite()
      : site(
            loop.io, [] { return RelayStatus{}; }, [](LogLevel, const std::string&) {}) {
    EXPECT_EQ(site.open({"127.0.0.1", 0, {}, false}), "");
  }
  std::string ask(const std::string& path) {
    RawPeer peer(site.port());
    peer.send("GET " + path + " HTTP/1.1\r\nHost: localhost\r\n\r\n");
    EXPECT_TRUE(peer.ends(loop));
    return peer.text;
  }

  Loop loop;
  RelaySite site;
};

TEST(RelaySite, AnswersWhatAServersStatusDoes) {
  AtSite at;
  EXPECT_THAT(at.ask("/api/status"), testing::HasSubstr("\"role\": \"relay\""));
  EXPECT_THAT(at.ask("/metrics"), testing::HasSubstr("connect_bridge_robots 0"));
  EXPECT_THAT(at.ask("/healthz"), testing::HasSubstr("alive"));
  EXPECT_THAT(at.ask("/readyz"), testing::HasSubstr("ready"));
  EXPECT_THAT(at.ask("/"), testing::StartsWith("HTTP/1.1 404"));
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
