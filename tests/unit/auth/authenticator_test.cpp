#include "auth/authenticator.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <fstream>

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

// Behind a reverse proxy all have one address.
TEST(Authenticator, ARightTokenGetsInWhateverOthersOfItsAddressTry) {
  AuthOptions options;
  options.token = kToken;
  const AuthSetup setup = make_authenticator(options, at(0));
  for (int i = 0; i < 1000; ++i)
    EXPECT_EQ(check(*setup.authenticator, "wrong", "127.0.0.1:1", 0).reason, "unknown token");
  EXPECT_TRUE(check(*setup.authenticator, kToken, "127.0.0.1:2", 0).identity.has_value());
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
