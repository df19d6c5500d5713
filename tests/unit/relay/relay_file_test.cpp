#include "relay/relay_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

constexpr char kRight[] =
    "listen: {address: \"0.0.0.0\", port: 443}\n"
    "tls: {certificate: relay.crt, private_key: relay.key}\n"
    "auth: {token_file: robots.yaml}\n";

std::string relay_problems(const std::string& text) {
  std::string all;
  const RelayFile file = read_relay_file(text, {});
  EXPECT_EQ(file.config.has_value(), file.problems.empty());
  for (const std::string& problem : file.problems) all += problem + "\n";
  return all;
}

TEST(RelayFile, HasTheParametersOfAServerThatARelayHasToo) {
  const RelayFile file = read_relay_file(kRight, {});
  ASSERT_TRUE(file.config);
  EXPECT_EQ(file.config->listen.addresses, std::vector<std::string>{"0.0.0.0"});
  EXPECT_EQ(file.config->listen.port, 443);
  EXPECT_EQ(file.config->tls.certificate_file, "relay.crt");
  EXPECT_EQ(file.config->auth.token_file, "robots.yaml");
}

TEST(RelayFile, HasProxiesThatAreTrusted) {
  std::string text = kRight;
  const std::string port = "port: 443";
  text.replace(text.find(port), port.size(), port + ", trusted_proxies: [192.0.2.1, 10.0.0.0/8]");
  const RelayFile file = read_relay_file(text, {});
  ASSERT_TRUE(file.config) << testing::PrintToString(file.problems);
  EXPECT_EQ(file.config->listen.trusted_proxies.size(), 2U);
  text.replace(text.find("192.0.2.1"), 9, "somewhere");
  EXPECT_THAT(relay_problems(text), testing::HasSubstr("listen.trusted_proxies"));
}

TEST(RelayFile, ShowsItsStatusOnTheLoopbackAlone) {
  const std::string text = kRight;
  const RelayFile file = read_relay_file(text + "status: {listen: \"127.0.0.1:9091\"}\n", {});
  ASSERT_TRUE(file.config);
  EXPECT_EQ(file.config->status.port, 9091);
  EXPECT_NE(relay_problems(text + "status: {listen: \"0.0.0.0:9091\"}\n"), "");
}

TEST(RelayFile, TellsAllThatIsWrong) {
  const std::string text = kRight;
  EXPECT_THAT(relay_problems(text + "rules: [all]\n"),
              testing::HasSubstr("line 4: rules is wrong"));
  EXPECT_THAT(relay_problems(text + "url: [1]\n"), testing::HasSubstr("url is wrong"));
  EXPECT_THAT(relay_problems("listen: {port: 1}\n"),
              testing::AllOf(testing::HasSubstr("tls.certificate is missing"),
                             testing::HasSubstr("auth.token_file is missing")));
  EXPECT_THAT(relay_problems(text + "tls.certificate: twice\n"), testing::HasSubstr("given twice"));
  std::string port = text;
  port.replace(port.find("443"), 3, "70000");
  EXPECT_THAT(relay_problems(port), testing::HasSubstr("listen.port: 70000 is wrong"));
  EXPECT_THAT(relay_problems("- a\n"), testing::HasSubstr("expected a map"));
  EXPECT_THAT(relay_problems("a: [\n"), testing::HasSubstr("this is no YAML"));
}

}  // namespace
}  // namespace connect_bridge
