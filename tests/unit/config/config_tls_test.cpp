// TLS in a configuration.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "config/config.hpp"
#include "config/explain.hpp"
#include "unit/config/yaml_parameters.hpp"

namespace connect_bridge {
namespace {

using testing::HasSubstr;

TEST(ConfigExplain, PinsOfTheServer) {
  const std::string pin(42, 'A');
  const ParameterMap by_pin{{"url", "wss://robot.example"},
                            {"tls.pin", std::vector<std::string>{pin + "A=", pin + "E="}}};
  EXPECT_THAT(explain(config_of(by_pin, Role::kClient)),
              HasSubstr("with TLS; the server's public key must have the pin " + pin + "A= or " +
                        pin + "E=\n"));
  ParameterMap both = by_pin;
  both["tls.ca"] = "/ca.pem";
  EXPECT_THAT(explain(config_of(both, Role::kClient)),
              HasSubstr(pin + "E=, and the certificate must be for robot.example and signed by "
                              "/ca.pem\n"));
}

TEST(ConfigExplain, TrustedProxies) {
  const ParameterMap given{
      {"listen.address", "0.0.0.0"},
      {"listen.proxy_header", "proxy_protocol"},
      {"listen.trusted_proxies", std::vector<std::string>{"10.0.0.1", "fd00::/8"}}};
  const Config config = config_of(given, Role::kServer);
  EXPECT_TRUE(config.listen.proxies_only);
  EXPECT_THAT(explain(config), HasSubstr("10.0.0.1 or fd00::/8 gives the client's address by "
                                         "proxy_protocol; only these may connect\n"));
  EXPECT_THAT(explain(config),
              HasSubstr("warning: listen.trusted_proxies: 0.0.0.0 is used without"));
  ParameterMap open = given;
  open["allow_plaintext"] = true;
  EXPECT_FALSE(config_of(open, Role::kServer).listen.proxies_only);
}

TEST(ConfigExplain, ALoginByCertificate) {
  const ParameterMap server{{"auth.method", "certificate"},
                            {"tls.certificate", "/c"},
                            {"tls.private_key", "/k"},
                            {"tls.ca", "/ca"}};
  EXPECT_THAT(explain(config_of(server, Role::kServer)),
              HasSubstr("login: by the client's certificate, which names the identity"));
  ParameterMap client = server;
  client.erase("tls.ca");
  client["url"] = "wss://robot.example";
  EXPECT_THAT(explain(config_of(client, Role::kClient)), HasSubstr("login: by certificate\n"));
}

}  // namespace
}  // namespace connect_bridge
