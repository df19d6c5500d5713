// HTTP proxies on the way to the server: parameters and the environment.
#include "config/http_proxy.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "config/explain.hpp"

namespace connect_bridge {
namespace {

using testing::HasSubstr;
using testing::Not;

using Environment = std::map<std::string, std::string>;

std::string text_of(const std::optional<HttpProxy>& proxy) {
  return proxy ? proxy->host + " " + std::to_string(proxy->port) + " " + proxy->login : "none";
}

Parsed parsed(const ParameterMap& given, const Environment& environment,
              Role role = Role::kClient) {
  Surroundings around;
  around.token_in_environment = true;
  around.variable = [environment](const char* name) {
    const auto found = environment.find(name);
    return found == environment.end() ? "" : found->second;
  };
  return parse_config(given, role, around);
}

// The proxy that a client of this URL takes.
std::string taken(const Environment& environment, const std::string& url = "wss://robot.example") {
  const Parsed made = parsed({{"url", url}, {"allow_plaintext", true}}, environment);
  return made.config ? text_of(made.config->dial.proxy) : to_text(made.problems.at(0));
}

TEST(HttpProxyUrl, HasHostPortAndLogin) {
  EXPECT_EQ(text_of(parse_http_proxy("http://proxy.example:3128")), "proxy.example 3128 ");
  EXPECT_EQ(text_of(parse_http_proxy("HTTP://proxy.example/")), "proxy.example 80 ");
  EXPECT_EQ(text_of(parse_http_proxy("proxy.example:8080")), "proxy.example 8080 ");
  EXPECT_EQ(text_of(parse_http_proxy("http://[2001:db8::1]:3128")), "2001:db8::1 3128 ");
  EXPECT_EQ(text_of(parse_http_proxy("http://anna:p%40ss%3a@proxy:1")), "proxy 1 anna:p@ss:");
  for (const char* wrong :
       {"", "http://", "https://proxy:1", "socks5://proxy:1", "http://proxy:0", "http://proxy:1/x",
        "http://proxy:1//", "http://anna@proxy:1", "http://a:%0d%0aX@proxy:1",
        "http://a:%4@proxy:1", "http://pro xy:1", "http://proxy:1\r\nX: y"})
    EXPECT_FALSE(parse_http_proxy(wrong)) << wrong;
}

TEST(HttpProxyUrl, NoProxyHasNamesAddressesAndPorts) {
  const auto exempt = [](std::string_view list, std::string_view host = "robot.example") {
    return is_exempt(list, host, 443);
  };
  for (const char* list : {"*", "robot.example", "a, robot.example", "example", ".example",
                           "*.example", "ROBOT.example", "a robot.example:443", "example:443"})
    EXPECT_TRUE(exempt(list)) << list;
  for (const char* list :
       {"", ",", ".", "bot.example", "robot", "robot.example:80", "a.robot.example"})
    EXPECT_FALSE(exempt(list)) << list;
  EXPECT_TRUE(exempt("10.0.0.7", "10.0.0.7"));
  EXPECT_FALSE(exempt("0.0.7", "10.0.0.7"));
  EXPECT_TRUE(exempt("2001:db8::1", "2001:db8::1"));
  EXPECT_TRUE(exempt("[2001:db8::1]:443", "2001:db8::1"));
  EXPECT_FALSE(exempt("[2001:db8::1]:80", "2001:db8::1"));
}

TEST(HttpProxy, IsThatOfTheEnvironment) {
  EXPECT_EQ(taken({{"https_proxy", "http://p:1"}, {"HTTPS_PROXY", "http://q:2"}}), "p 1 ");
  EXPECT_EQ(taken({{"HTTPS_PROXY", "http://me:pw@q:2"}}), "q 2 me:pw");
  EXPECT_EQ(taken({}), "none");
  EXPECT_EQ(taken({{"https_proxy", "http://p:1"}, {"no_proxy", "example"}}), "none");
  EXPECT_EQ(taken({{"https_proxy", "http://p:1"}, {"NO_PROXY", "example"}}), "none");
  EXPECT_EQ(taken({{"https_proxy", "http://p:1"}}, "ws://robot.example"), "none");
  EXPECT_EQ(taken({{"https_proxy", "http://p:1"}}, "wss://localhost"), "none");
  EXPECT_EQ(taken({{"https_proxy", "http://me:hush@p:x"}}),
            "http_proxy: expected http://host:port in the environment variable https_proxy; or "
            "http_proxy: none, if the server is reached without a proxy");
}

TEST(HttpProxy, IsThatOfTheParameters) {
  const Environment environment{{"https_proxy", "http://p:1"}};
  ParameterMap given{{"url", "wss://robot.example"}, {"http_proxy", "none"}};
  EXPECT_EQ(text_of(parsed(given, environment).config->dial.proxy), "none");
  given["http_proxy"] = "http://own.example:3128";
  given["http_proxy_login"] = "me:hush";
  const Config config = parsed(given, environment).config.value();
  EXPECT_EQ(text_of(config.dial.proxy), "own.example 3128 me:hush");
  EXPECT_THAT(explain(config),
              HasSubstr("; through the HTTP proxy own.example:3128, with a login\n"));
  EXPECT_THAT(explain(config), Not(HasSubstr("hush")));
}

TEST(HttpProxy, MistakesAreToldWithoutTheLogin) {
  const auto problem = [](const ParameterMap& more) {
    ParameterMap given = more;
    given["url"] = "wss://robot.example";
    const Parsed made = parsed(given, {});
    EXPECT_EQ(made.problems.size(), 1U);
    return made.problems.empty() ? "" : to_text(made.problems[0]);
  };
  const std::string with_login = problem({{"http_proxy", "http://me:hush@p:1"}});
  EXPECT_THAT(with_login, HasSubstr("a URL without user and password"));
  EXPECT_THAT(with_login, Not(HasSubstr("hush")));
  EXPECT_THAT(problem({{"http_proxy", "https://p:1"}}),
              HasSubstr("e.g. http://proxy.example:3128"));
  EXPECT_THAT(problem({{"http_proxy_login", "me:hush"}}),
              HasSubstr("http_proxy: http://host:port too"));
  const std::string login = problem({{"http_proxy", "http://p:1"}, {"http_proxy_login", "hush"}});
  EXPECT_THAT(login, HasSubstr("\"user:password\""));
  EXPECT_THAT(login, HasSubstr("(hidden)"));
}

}  // namespace
}  // namespace connect_bridge
