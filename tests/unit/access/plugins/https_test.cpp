// One HTTP request, for login methods: its path, and that it ends in time.
#include "access/plugins/https.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <fstream>
#include <thread>

#include "unit/net/tls/certificates.hpp"
#include "unit/net/websocket/fake_proxy.hpp"
#include "unit/net/websocket/harness.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// The bridge's own server answers a GET, too: what it is, with HTTP 426.
class HttpsTest : public testing::Test {
 protected:
  static ListenOptions listening(const Authority::Files& files) {
    ListenOptions listen;
    listen.tls = TlsOptions{files.certificate, files.key};
    return listen;
  }
  // fetch() blocks, the other end is in this test's loop.
  HttpAnswer fetched(Loop& loop, const std::optional<HttpProxy>& proxy) {
    Https https{authority.ca, proxy};
    return fetched(loop, https);
  }
  HttpAnswer fetched(Loop& loop, Https& https) {
    HttpAnswer answer;
    std::atomic<bool> done = false;
    std::thread asking([&] {
      answer = https.fetch(request);
      done = true;
    });
    loop.until([&] { return done.load(); });
    asking.join();
    return answer;
  }

  Authority authority{scratch_folder() + "https_"};
  Pair pair{listening(authority.sign("id", "DNS:id.example"))};
  HttpRequest request{{true, "id.example", 443, "/keys"}, "", 3s};
};

TEST_F(HttpsTest, GoesThroughAProxyThatLooksUpTheName) {
  FakeProxy proxy{pair.loop, kDone, pair.server.network.listen_port()};
  const HttpAnswer answer = fetched(pair.loop, proxy.proxy("me:secret"));
  EXPECT_EQ(answer.problem, "");
  EXPECT_EQ(answer.status, 426);
  EXPECT_THAT(answer.body, HasSubstr("ROS2 Connect"));
  EXPECT_THAT(proxy.request, HasSubstr("CONNECT id.example:443 HTTP/1.1\r\n"));
  EXPECT_THAT(proxy.request, HasSubstr("\r\nProxy-Authorization: Basic bWU6c2VjcmV0\r\n"));
}

// A context is made once, and again when the authority's file has changed.
TEST_F(HttpsTest, FollowsTheFileOfAuthorities) {
  Pair direct{listening(authority.sign("direct", "IP:127.0.0.1"))};
  request.url.host = "127.0.0.1";
  request.url.port = direct.server.network.listen_port();
  const Authority other{scratch_folder() + "https_other_", "Another authority"};
  const std::string file = scratch_folder() + "https_followed.pem";
  const auto trust = [&](const std::string& ca) {
    std::ofstream(file) << std::ifstream(ca).rdbuf();
  };
  trust(other.ca);
  Https https{file, std::nullopt};
  EXPECT_THAT(fetched(direct.loop, https).problem, HasSubstr("TLS: "));
  trust(authority.ca);
  EXPECT_EQ(fetched(direct.loop, https).problem, "");
  std::ofstream(file) << "half a file";
  EXPECT_THAT(fetched(direct.loop, https).problem, HasSubstr(file)) << "it is told";
  trust(authority.ca);
  EXPECT_EQ(fetched(direct.loop, https).problem, "");
  trust(other.ca);
  EXPECT_THAT(fetched(direct.loop, https).problem, HasSubstr("TLS: "));
}

TEST_F(HttpsTest, ChecksTheName) {
  request.url.host = "127.0.0.1";
  request.url.port = pair.server.network.listen_port();
  EXPECT_THAT(fetched(pair.loop, std::nullopt).problem, HasSubstr("not for '127.0.0.1'"));
}

TEST_F(HttpsTest, TellsWhatTheProxySays) {
  FakeProxy proxy{pair.loop, "HTTP/1.1 407 Proxy Authentication Required\r\n\r\n"};
  HttpProxy asked = proxy.proxy();
  asked.login_key = "https_proxy";
  EXPECT_THAT(fetched(pair.loop, asked).problem, HasSubstr("it wants a login (https_proxy)"));
}

// Whatever the headers say of its length, and though all of it comes at once.
TEST_F(HttpsTest, IsBoundInSize) {
  constexpr std::size_t kSize = 100;
  const std::string body(kSize, 'x');
  const std::string answers[] = {
      "Content-Length: 100\r\n\r\n" + body,
      "Transfer-Encoding: chunked\r\n\r\n64\r\n" + body + "\r\n0\r\n\r\n",
      "\r\n" + body,
  };
  for (const std::string& answer : answers) {
    for (const std::size_t limit : {kSize - 1, kSize}) {
      const FakeProxy service{pair.loop, "HTTP/1.1 200 OK\r\n" + answer};
      request.url = {false, "127.0.0.1", service.proxy().port, "/"};
      request.answer_bytes_max = limit;
      const HttpAnswer got = fetched(pair.loop, std::nullopt);
      EXPECT_EQ(got.problem, limit < kSize ? "the answer is too large" : "") << answer;
      EXPECT_EQ(got.body, limit < kSize ? "" : body);
    }
  }
}

// No memory is taken for what is only announced.
TEST_F(HttpsTest, BelievesNoLength) {
  const FakeProxy service{pair.loop,
                          "HTTP/1.1 200 OK\r\nContent-Length: 8198552921648689609\r\n\r\nx"};
  request.url = {false, "127.0.0.1", service.proxy().port, "/"};
  EXPECT_EQ(fetched(pair.loop, std::nullopt).problem, "the answer is too large");
}

TEST_F(HttpsTest, IsBoundInTime) {
  const tcp::acceptor silent{pair.loop.io, {asio::ip::address_v4::loopback(), 0}};
  request.timeout = 200ms;
  const HttpProxy proxy{"127.0.0.1", silent.local_endpoint().port(), ""};
  EXPECT_EQ(fetched(pair.loop, proxy).problem, "no answer in time");
  request.url.host = "127.0.0.1";
  request.url.port = silent.local_endpoint().port();
  EXPECT_EQ(fetched(pair.loop, std::nullopt).problem, "no answer in time");
}

TEST_F(HttpsTest, ThatTheEnvironmentNamesNoProxyIsToldAtTheStart) {
  const char* const kept = std::getenv("https_proxy");
  const std::string before = kept ? kept : "";
  std::vector<std::string> problems;
  ::setenv("https_proxy", "http://me:hush@p:x", 1);
  static_cast<void>(https_fetch({true, "id.example", 443, "/"}, "", problems));
  static_cast<void>(https_fetch({false, "127.0.0.1", 80, "/"}, "", problems));
  kept ? ::setenv("https_proxy", before.c_str(), 1) : ::unsetenv("https_proxy");
  EXPECT_THAT(problems, ElementsAre("environment variable https_proxy: not a proxy's URL"));
}

}  // namespace
}  // namespace connect_bridge::test
