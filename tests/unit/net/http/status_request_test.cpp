// What is wrong with a request for the status, whoever sent it.
#include "net/http/status_request.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

StatusGet a_request(const char* host = "localhost") {
  StatusGet request{http::verb::get, "/api/status", 11};
  request.set(http::field::host, host);
  return request;
}

// DNS rebinding: a page of evil.example asks a name of its own that leads here.
TEST(StatusRequest, AHostThatIsNotThisMachineIsMisdirected) {
  for (const char* host :
       {"evil.example", "evil.example:9091", "localhost.evil.example", "", "127.0.0.1.evil.example",
        "[::1", "[::1]x", "a@localhost", "localhost:9091:1"})
    EXPECT_EQ(wrong_with(a_request(host), nullptr).status, 421U) << host;
  for (const char* host : {"localhost", "LOCALHOST:8080", "127.0.0.1:9091", "[::1]:9091"})
    EXPECT_EQ(wrong_with(a_request(host), nullptr).status, 0U) << host;
}

TEST(StatusRequest, PagesOfElsewhereMayNotAsk) {
  for (const char* site : {"same-origin", "none"}) {
    StatusGet own = a_request();
    own.set("Sec-Fetch-Site", site);
    EXPECT_EQ(wrong_with(own, nullptr).status, 0U) << site;
  }
  for (const char* site : {"cross-site", "same-site"}) {
    StatusGet other = a_request();
    other.set("Sec-Fetch-Site", site);
    EXPECT_EQ(wrong_with(other, nullptr).status, 403U) << site;
  }
  StatusGet by_script = a_request();
  by_script.set(http::field::origin, "http://localhost:9091");
  EXPECT_EQ(wrong_with(by_script, nullptr).status, 403U);
}

TEST(StatusRequest, IsOfOneKind) {
  StatusGet post = a_request();
  post.method(http::verb::post);
  EXPECT_EQ(wrong_with(post, nullptr).status, 405U);
  StatusGet by_proxy = a_request();
  by_proxy.target("http://localhost/");
  EXPECT_EQ(wrong_with(by_proxy, nullptr).status, 400U);
  StatusGet two_hosts = a_request();
  two_hosts.insert(http::field::host, "localhost");
  EXPECT_EQ(wrong_with(two_hosts, nullptr).status, 400U);
  StatusGet body = a_request();
  body.set(http::field::content_length, "1000000");
  EXPECT_EQ(wrong_with(body, nullptr).status, 400U);
}

}  // namespace
}  // namespace connect_bridge
