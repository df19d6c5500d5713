// Dialing through an HTTP proxy.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "net/tls/tls.hpp"
#include "net/tls/way.hpp"
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

// The failure of a dial through a proxy that answers this, without whose it is.
Failure failure(const std::string& answer, const std::string& login = "") {
  Pair pair;
  FakeProxy proxy{pair.loop, answer};
  DialOptions options = pair.dial_options();
  options.proxy = proxy.proxy(login);
  options.timeout = 500ms;
  EXPECT_FALSE(pair.connect(options));
  const std::string& text = pair.client.failures[kDial];
  const std::string by = " by the proxy 127.0.0.1:" + std::to_string(options.proxy->port) + ": ";
  EXPECT_THAT(text, HasSubstr(by));
  return {pair.client.causes[kDial], text.substr(std::min(text.find(by) + by.size(), text.size()))};
}

TEST(DialProxy, TellsWhatIsWrong) {
  const std::string wants = "HTTP/1.1 407 Proxy Authentication Required\r\n\r\n";
  EXPECT_EQ(failure(wants), (Failure{Cause::kProxyLogin, "it wants a login (http_proxy_login)"}));
  EXPECT_EQ(failure(wants, "me:wrong"),
            (Failure{Cause::kProxyLogin, "it refuses this login (http_proxy_login)"}));
  EXPECT_EQ(failure("HTTP/1.1 403 by policy\r\nContent-Length: 9\r\n\r\nforbidden"),
            (Failure{Cause::kProxyRefuses, "it refuses CONNECT with HTTP 403 Forbidden"}));
  for (const std::string& answer :
       {std::string{"SSH-2.0-OpenSSH_9.2\r\n\r\n"}, std::string{}, std::string{kDone} + "early",
        "HTTP/1.1 200 OK\r\nX: " + std::string(9000, 'x')})
    EXPECT_EQ(failure(answer).cause, Cause::kProxyRefuses) << answer;
}

TEST(DialProxy, IsBoundInTime) {
  Pair pair;
  const auto expect = [&](std::uint16_t port, Cause cause, const std::string& said) {
    DialOptions options = pair.dial_options();
    options.proxy = HttpProxy{"127.0.0.1", port, ""};
    options.timeout = 200ms;
    EXPECT_FALSE(pair.connect(options));
    EXPECT_EQ(pair.client.causes[kDial], cause);
    EXPECT_THAT(pair.client.failures[kDial], HasSubstr(said));
    pair.client.failures.clear();
  };
  tcp::acceptor silent{pair.loop.io, {asio::ip::address_v4::loopback(), 0}};
  expect(silent.local_endpoint().port(), Cause::kProxySilent,
         "no answer in time (CONNECT of the proxy)");
  silent.close();
  expect(1, Cause::kProxyUnreachable, "by the proxy 127.0.0.1:1: connection refused");
}

TEST(DialProxy, OfTheEnvironmentIsNamedWithItsVariable) {
  Pair pair;
  DialOptions options = pair.dial_options();
  options.proxy = HttpProxy{"127.0.0.1", 1};
  options.proxy->variable = "https_proxy";
  EXPECT_FALSE(pair.connect(options));
  EXPECT_EQ(pair.client.causes[kDial], Cause::kProxyUnreachable);
  EXPECT_THAT(pair.client.failures[kDial],
              HasSubstr(" by the proxy 127.0.0.1:1 (https_proxy of the environment): "));
}

// A name may lead elsewhere than its user believes: an old line of /etc/hosts.
TEST(Dial, TheAddressOfANameIsShown) {
  Pair pair;
  DialOptions options;
  options.url = {false, "localhost", 1, "/"};
  EXPECT_FALSE(pair.connect(options));
  EXPECT_THAT(pair.client.failures[kDial],
              testing::MatchesRegex("ws://localhost:1/ \\(.*(127.0.0.1|::1)\\): .+"));
  options.url.host = "127.0.0.1";
  EXPECT_FALSE(pair.connect(options, {78}));
  EXPECT_THAT(pair.client.failures[{78}], HasSubstr("ws://127.0.0.1:1/: connection refused"));
}

// As ssh -L does whose target is not there.
TEST(Dial, WhoEndsTheConnectionWithoutAByteForwardsToNobody) {
  for (const bool secure : {false, true}) {
    Pair pair;
    tcp::acceptor forwards{pair.loop.io, {asio::ip::address_v4::loopback(), 0}};
    forwards.async_accept([](ErrorCode, tcp::socket accepted) { accepted.close(); });
    DialOptions options;
    options.url = {secure, "127.0.0.1", forwards.local_endpoint().port(), "/"};
    EXPECT_FALSE(pair.connect(options));
    EXPECT_EQ(pair.client.causes[kDial], Cause::kServerSilent);
    EXPECT_THAT(pair.client.failures[kDial], HasSubstr("without a byte"));
  }
}

// Half a minute of a resolver cannot be waited for: what would be said at the end of the time.
TEST(Dial, ANameServerThatIsSilentIsNoFirewall) {
  Loop loop;
  const auto silence = [&](std::optional<HttpProxy> proxy) {
    return std::make_shared<Way>(loop.io, "robot.example", 443, std::move(proxy))->silence();
  };
  EXPECT_EQ(silence({}), (Failure{Cause::kResolverSilent, "no answer in time (the name look-up)"}));
  EXPECT_EQ(silence(HttpProxy{"proxy.example", 3128}).cause, Cause::kProxyUnreachable);
  const auto cause = [](const ErrorCode& error) { return failure_of(error, nullptr, "h").cause; };
  EXPECT_EQ(cause(asio::error::host_not_found_try_again), Cause::kResolverSilent);
  EXPECT_EQ(cause(asio::error::host_not_found), Cause::kHostUnknown);
  EXPECT_EQ(cause(asio::error::host_unreachable), Cause::kNoAnswer);
}

}  // namespace
}  // namespace connect_bridge::test
