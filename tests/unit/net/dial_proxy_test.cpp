// Dialing through an HTTP proxy.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>

#include "unit/net/certificates.hpp"
#include "unit/net/harness.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge::test {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using testing::HasSubstr;

constexpr char kDone[] = "HTTP/1.1 200 Connection established\r\n\r\n";

// Answers a request with a text, then carries bytes to and from a server, if it has one.
class FakeProxy {
 public:
  FakeProxy(Loop& loop, std::string answer, std::uint16_t server = 0)
      : near_(loop.io), far_(loop.io), answer_(std::move(answer)), server_(server) {
    acceptor_.async_accept(near_, [this](auto error) {
      if (!error) read_request();
    });
  }

  [[nodiscard]] HttpProxy proxy(const std::string& login = "") const {
    return {"127.0.0.1", acceptor_.local_endpoint().port(), login};
  }
  std::string request;

 private:
  void read_request() {
    near_.async_read_some(asio::buffer(up_), [this](auto error, std::size_t bytes) {
      if (error) return;
      request.append(up_.data(), bytes);
      if (request.find("\r\n\r\n") == std::string::npos) return read_request();
      asio::write(near_, asio::buffer(answer_));
      if (server_ == 0) return near_.close();
      far_.connect({asio::ip::address_v4::loopback(), server_});
      carry(near_, far_, up_);
      carry(far_, near_, down_);
    });
  }
  void carry(tcp::socket& from, tcp::socket& to, std::array<char, 4096>& buffer) {
    from.async_read_some(asio::buffer(buffer), [&, this](auto error, std::size_t bytes) {
      if (error) return;
      asio::write(to, asio::buffer(buffer.data(), bytes));
      carry(from, to, buffer);
    });
  }

  tcp::socket near_, far_;
  tcp::acceptor acceptor_{near_.get_executor(), {asio::ip::address_v4::loopback(), 0}};
  std::string answer_;
  std::uint16_t server_;
  std::array<char, 4096> up_{}, down_{};
};

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
  listen.tls = ServerTls{files.certificate, files.key, ""};
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

// What a dial through a proxy that answers this fails with.
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
            "it refuses the way with HTTP 403 Forbidden");
  EXPECT_THAT(failure("SSH-2.0-OpenSSH_9.2\r\n\r\n"), HasSubstr("no HTTP proxy"));
  EXPECT_EQ(failure(""), "it ended the connection instead of answering");
  EXPECT_EQ(failure(std::string{kDone} + "early"), "it sent more than its answer");
  EXPECT_THAT(failure("HTTP/1.1 200 OK\r\nX: " + std::string(9000, 'x')),
              HasSubstr("no HTTP proxy (header limit exceeded)"));
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
