#include "auth/authenticator.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <fstream>

#include "auth/backoff.hpp"
#include "auth/credential.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr char kToken[] = "0123456789abcdef-secret";

Now at(double seconds) {
  Now now;
  now.steady =
      TimePoint{std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds))};
  return now;
}

struct Answer {
  std::optional<Identity> identity;
  std::string reason;
};

Answer check(Authenticator& method, const std::string& token, const std::string& peer, double time,
             const std::string& name = "token") {
  Answer answer;
  int verdicts = 0;
  method.check({name, Bytes(token.begin(), token.end()), peer}, at(time),
               [&](std::optional<Identity> who, std::string why) {
                 ++verdicts;
                 answer = {std::move(who), std::move(why)};
               });
  EXPECT_EQ(verdicts, 1);
  return answer;
}

std::string write_file(const std::string& name, const std::string& text, mode_t mode = 0600) {
  const std::string file = test::scratch_folder() + name;
  std::ofstream{file} << text;
  ::chmod(file.c_str(), mode);
  return file;
}

TEST(Authenticator, KnowsTheTokenAndNothingElse) {
  AuthOptions options;
  options.token = kToken;
  const AuthSetup setup = make_authenticator(options, at(0));
  ASSERT_THAT(setup.problems, IsEmpty());
  EXPECT_EQ(check(*setup.authenticator, kToken, "1.1.1.1:1", 0).identity.value().name, "token");
  EXPECT_FALSE(check(*setup.authenticator, "", "1.1.1.1:1", 0).identity.has_value());
  EXPECT_FALSE(check(*setup.authenticator, std::string(kToken) + "x", "1.1.1.1:1", 0).identity);
  EXPECT_THAT(check(*setup.authenticator, kToken, "1.1.1.1:1", 0, "none").reason,
              HasSubstr("method 'none'"));
}

TEST(Authenticator, WithoutLoginEverybodyIsNobody) {
  AuthOptions options;
  options.method = "none";
  const AuthSetup setup = make_authenticator(options, at(0));
  EXPECT_EQ(check(*setup.authenticator, "", "1.1.1.1:1", 0, "none").identity.value().name, "");
}

TEST(Authenticator, ReportsProblems) {
  AuthOptions options;
  EXPECT_THAT(make_authenticator(options, at(0)).problems, ElementsAre(HasSubstr("at least one")));
  options.token = "short";
  options.token_file = "/nowhere/tokens.yaml";
  const AuthSetup both = make_authenticator(options, at(0));
  EXPECT_THAT(both.problems,
              ElementsAre(HasSubstr("auth.token: the token has 5 characters"),
                          HasSubstr("'/nowhere/tokens.yaml' cannot be read: No such file")));
  EXPECT_EQ(both.authenticator, nullptr);
  options = {};
  options.method = "magic";
  EXPECT_THAT(make_authenticator(options, at(0)).problems, ElementsAre(HasSubstr("'magic'")));
}

TEST(Authenticator, ReadsAFileAndWarnsWhenOthersCanToo) {
  AuthOptions options;
  options.token_file = write_file("open_tokens.yaml", std::string("anna: ") + kToken + "\n", 0644);
  const AuthSetup setup = make_authenticator(options, at(0));
  EXPECT_THAT(setup.warnings, ElementsAre(HasSubstr("may read it")));
  EXPECT_EQ(check(*setup.authenticator, kToken, "1.1.1.1:1", 0).identity.value().name, "anna");
}

TEST(Authenticator, SlowsDownGuessing) {
  AuthOptions options;
  options.token = kToken;
  const AuthSetup setup = make_authenticator(options, at(0));
  Authenticator& method = *setup.authenticator;
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(check(method, "wrong", "6.6.6.6:" + std::to_string(i), 0).reason, "unknown token");
  }
  // Even the right token is not looked at now; other addresses are not concerned.
  EXPECT_THAT(check(method, kToken, "6.6.6.6:9", 0.9).reason, HasSubstr("not checked"));
  EXPECT_TRUE(check(method, kToken, "7.7.7.7:9", 0.9).identity.has_value());
  EXPECT_EQ(check(method, "wrong", "6.6.6.6:9", 1.1).reason, "unknown token");
  EXPECT_THAT(check(method, "wrong", "6.6.6.6:9", 1.2).reason, HasSubstr("not checked"));
  EXPECT_TRUE(check(method, kToken, "6.6.6.6:9", 2.2).identity.has_value());
  for (int i = 0; i < 100; ++i) {
    EXPECT_TRUE(check(method, kToken, "8.8.8.8:1", 3).identity.has_value());
  }
}

TEST(Backoff, CountsIPv6BySixtyFourBits) {
  EXPECT_EQ(network_of("203.0.113.5:51234"), "203.0.113.5");
  EXPECT_EQ(network_of("[2001:db8:1:2:3:4:5:6]:1"), "2001:db8:1:2::");
  EXPECT_EQ(network_of("[fe80::1%eth0]:1"), "fe80::");
  EXPECT_EQ(network_of("[::1]:1"), "::");
  for (const char* odd : {"", "[", "[]", ":", "x", "[x]:1"}) static_cast<void>(network_of(odd));
}

TEST(Backoff, IsBoundedAndForgetsThoseWhoFailedLeast) {
  BackoffOptions options;
  options.addresses_max = 10;
  Backoff backoff{options};
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(backoff.take("6.6.6.6:1", at(0).steady));
  for (int i = 0; i < 1000; ++i) {
    EXPECT_TRUE(backoff.take("10.0." + std::to_string(i) + ".1:1", at(0).steady));
  }
  EXPECT_EQ(backoff.size(), 10U);
  EXPECT_FALSE(backoff.take("6.6.6.6:1", at(0).steady));
  EXPECT_TRUE(backoff.take("1.1.1.1:1", at(10).steady));
  EXPECT_EQ(backoff.size(), 1U);
  backoff.give_back("1.1.1.1:1", at(10).steady);
  EXPECT_EQ(backoff.size(), 0U);
}

TEST(Credential, ComesFromParameterThenFileThenEnvironment) {
  ::setenv(kTokenVariable, "from-environment-0123", 1);
  CredentialOptions options;
  Credential got = client_credential(options);
  EXPECT_EQ(got.source, "environment variable CONNECT_BRIDGE_TOKEN");
  EXPECT_EQ(std::string(got.bytes.begin(), got.bytes.end()), "from-environment-0123");
  options.token_file = write_file("robot.token", "  from-file-0123456789\n");
  got = client_credential(options);
  EXPECT_EQ(std::string(got.bytes.begin(), got.bytes.end()), "from-file-0123456789");
  EXPECT_THAT(got.warnings, IsEmpty());
  options.token = "from-parameter-0123";
  got = client_credential(options);
  EXPECT_EQ(std::string(got.bytes.begin(), got.bytes.end()), "from-parameter-0123");
  options.method = "none";
  got = client_credential(options);
  EXPECT_TRUE(got.bytes.empty());
  EXPECT_THAT(got.problems, IsEmpty());
  ::unsetenv(kTokenVariable);
}

TEST(Credential, ReportsProblems) {
  ::unsetenv(kTokenVariable);
  CredentialOptions options;
  EXPECT_THAT(client_credential(options).problems, ElementsAre(HasSubstr("no token")));
  options.token_file = "/nowhere/robot.token";
  EXPECT_THAT(client_credential(options).problems, ElementsAre(HasSubstr("cannot be read")));
  options.token_file =
      write_file("two.token", "token-one-0123456789\ntoken-two-0123456789\n", 0604);
  const Credential two = client_credential(options);
  EXPECT_THAT(two.problems, ElementsAre(HasSubstr("a blank or a character")));
  EXPECT_THAT(two.warnings, ElementsAre(HasSubstr("chmod 600")));
  options.token_file = test::scratch_folder();
  EXPECT_THAT(client_credential(options).problems, ElementsAre(HasSubstr("directory")));
}

}  // namespace
}  // namespace connect_bridge
