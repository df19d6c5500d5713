// Dialing through an HTTP proxy.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "unit/net/tls/certificates.hpp"
#include "unit/net/websocket/fake_proxy.hpp"
#include "unit/net/websocket/harness.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge::test {
namespace {

using testing::HasSubstr;

TEST(DialProxy, CarriesTheConnection) {
  Pair pair;
  const std::uint16_t port = pair.server.network.listen_port();
  FakeProxy proxy{pair.loop, kDone, port};
  DialOptions options = pair.dial_options();
  options.proxy = proxy.proxy();
  ASSERT_TRUE(pair.connect(options)) << pair.client.failures[kDial];
  const std::string target = "127.0.0.1:" + std::to_string(port);
  EXPECT_EQ(proxy.request, "CONNECT " + target + " HTTP/1.1\r\nHost: " + target +
                               "\r\nUser-Agent: ROS2 Connect\r\n\r\n");
  pair.client.send(kDial, "through it");
  EXPECT_TRUE(pair.loop.until([&] { return pair.server.packets(pair.accepted()) == 1; }));
}

TEST(DialProxy, TlsIsWithTheServer) {
  Authority authority{scratch_folder() + "dial_proxy_"};
  const auto files = authority.sign("robot", "DNS:robot.example");
  ListenOptions listen;
  listen.tls = TlsOptions{files.certificate, files.key};
  Pair pair{listen};
  FakeProxy proxy{pair.loop, kDone, pair.server.network.listen_port()};
  DialOptions options;
  options.url = {true, "robot.example", 443, "/"};  // looked up by the proxy, not here
  options.tls.ca_file = authority.ca;
  options.proxy = proxy.proxy("me:secret");
  ASSERT_TRUE(pair.connect(options)) << pair.client.failures[kDial];
  EXPECT_THAT(proxy.request, HasSubstr("CONNECT robot.example:443 HTTP/1.1\r\n"));
  EXPECT_THAT(proxy.request, HasSubstr("\r\nProxy-Authorization: Basic bWU6c2VjcmV0\r\n"));
}

// The error of a dial through a proxy that answers this.
std::string failure(const std::string& answer, const std::string& login = "") {
  Pair pair;
  FakeProxy proxy{pair.loop, answer};
  DialOptions options = pair.dial_options();
  options.proxy = proxy.proxy(login);
  options.timeout = 500ms;
  EXPECT_FALSE(pair.connect(options));
  const std::string& text = pair.client.failures[kDial];
  const std::string by = " by the proxy 127.0.0.1:" + std::to_string(options.proxy->port) + ": ";
  EXPECT_THAT(text, HasSubstr(by));
  return text.substr(std::min(text.find(by) + by.size(), text.size()));
}

TEST(DialProxy, TellsWhatIsWrong) {
  const std::string wants = "HTTP/1.1 407 Proxy Authentication Required\r\n\r\n";
  EXPECT_EQ(failure(wants), "it wants a login (http_proxy_login)");
  EXPECT_EQ(failure(wants, "me:wrong"), "it refuses this login (http_proxy_login)");
  EXPECT_EQ(failure("HTTP/1.1 403 by policy\r\nContent-Length: 9\r\n\r\nforbidden"),
            "it refuses CONNECT with HTTP 403 Forbidden");
  EXPECT_THAT(failure("SSH-2.0-OpenSSH_9.2\r\n\r\n"), HasSubstr("not an HTTP proxy"));
  EXPECT_EQ(failure(""), "it ended the connection instead of answering");
  EXPECT_EQ(failure(std::string{kDone} + "early"), "it sent more than its answer");
  EXPECT_THAT(failure("HTTP/1.1 200 OK\r\nX: " + std::string(9000, 'x')),
              HasSubstr("not an HTTP proxy (header limit exceeded)"));
}

TEST(DialProxy, IsBoundInTime) {
  Pair pair;
  const auto expect = [&](std::uint16_t port, const std::string& said) {
    DialOptions options = pair.dial_options();
    options.proxy = HttpProxy{"127.0.0.1", port, ""};
    options.timeout = 200ms;
    EXPECT_FALSE(pair.connect(options));
    EXPECT_THAT(pair.client.failures[kDial], HasSubstr(said));
    pair.client.failures.clear();
  };
  tcp::acceptor silent{pair.loop.io, {asio::ip::address_v4::loopback(), 0}};
  expect(silent.local_endpoint().port(), "no answer in time (CONNECT of the proxy)");
  silent.close();
  expect(1, "by the proxy 127.0.0.1:1: connection refused");
}

}  // namespace
}  // namespace connect_bridge::test
