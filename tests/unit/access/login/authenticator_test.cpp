#include "access/login/authenticator.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <ctime>
#include <fstream>
#include <thread>

#include "access/login/credential.hpp"
#include "access/login/secret.hpp"
#include "access/login/token_login.hpp"
#include "core/base/hex.hpp"
#include "unit/no_descriptors.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr char kToken[] = "0123456789abcdef-secret";

constexpr Stamp kEarly = 0;

Judgement check(Authenticator& method, const std::string& token, const std::string& peer,
                const std::string& name = "token") {
  return method.judge({name, Bytes(token.begin(), token.end()), peer}, kEarly);
}

std::string token_entry(const std::string& name, const std::string& more = {}) {
  const ByteView token{reinterpret_cast<const std::uint8_t*>(kToken), sizeof kToken - 1};
  return "- {identity: " + name + ", token_sha256: " + to_hex(sha256(token)) + more + "}\n";
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
  const AuthSetup setup = make_authenticator(options, kEarly);
  ASSERT_THAT(setup.problems, IsEmpty());
  EXPECT_EQ(check(*setup.authenticator, kToken, "1.1.1.1:1").identity.value().name, "token");
  EXPECT_FALSE(check(*setup.authenticator, "", "1.1.1.1:1").identity.has_value());
  EXPECT_FALSE(check(*setup.authenticator, std::string(kToken) + "x", "1.1.1.1:1").identity);
  EXPECT_THAT(check(*setup.authenticator, kToken, "1.1.1.1:1", "none").reason,
              HasSubstr("method 'none'"));
}

TEST(Authenticator, WithoutLoginEverybodyIsNobody) {
  AuthOptions options;
  options.method = "none";
  const AuthSetup setup = make_authenticator(options, kEarly);
  EXPECT_EQ(check(*setup.authenticator, "", "1.1.1.1:1", "none").identity.value().name, "");
}

TEST(Authenticator, ReportsProblems) {
  AuthOptions options;
  EXPECT_THAT(make_authenticator(options, kEarly).problems, ElementsAre(HasSubstr("at least one")));
  options.token = "short";
  options.token_file = "/nowhere/tokens.yaml";
  const AuthSetup both = make_authenticator(options, kEarly);
  EXPECT_THAT(both.problems,
              ElementsAre(HasSubstr("auth.token: the token has 5 characters"),
                          HasSubstr("'/nowhere/tokens.yaml' cannot be read: No such file")));
  EXPECT_EQ(both.authenticator, nullptr);
  options = {};
  options.method = "magic";
  EXPECT_THAT(make_authenticator(options, kEarly).problems, ElementsAre(HasSubstr("'magic'")));
}

TEST(Authenticator, ReadsAFileAndWarnsWhenOthersCanToo) {
  AuthOptions options;
  options.token_file = write_file("open.token", kToken, 0644);
  const AuthSetup setup = make_authenticator(options, kEarly);
  EXPECT_THAT(setup.warnings, ElementsAre(HasSubstr("may read it")));
  EXPECT_EQ(check(*setup.authenticator, kToken, "1.1.1.1:1").identity.value().name, "token");
  options.token_file =
      write_file("open_tokens.yaml", token_entry("anna"), 0644);  // hashes are no secret
  EXPECT_THAT(make_authenticator(options, kEarly).warnings, IsEmpty());
}

// An entry is copied for its token now and then, which no list of causes would find.
TEST(Authenticator, KnowsTheHashOfAnEntryFromItsToken) {
  AuthOptions options;
  options.token_file = write_file("tokens.yaml", token_entry("anna"));
  const AuthSetup setup = make_authenticator(options, kEarly);
  const std::string text(kToken);
  const std::string hash =
      to_hex(sha256(ByteView(reinterpret_cast<const std::uint8_t*>(text.data()), text.size())));
  const Judgement judged = check(*setup.authenticator, hash, "1.1.1.1:1");
  EXPECT_FALSE(judged.identity);
  EXPECT_THAT(judged.reason,
              HasSubstr("it is the token_sha256 of the entry of anna, not the token"));
  EXPECT_EQ(check(*setup.authenticator, std::string(64, 'a'), "1.1.1.1:1").reason, "unknown token");
}

TEST(Authenticator, RefusesAFileThatEverybodyMayChange) {
  AuthOptions options;
  options.token_file = write_file("wide_open.yaml", token_entry("anna"), 0602);
  EXPECT_THAT(make_authenticator(options, kEarly).problems,
              ElementsAre(HasSubstr("every user of this machine may change")));
}

// Its reader would wait without end for a writer.
TEST(Authenticator, APipeIsNoTokenFileUnlessModesAreNotAsked) {
  const std::string pipe = test::scratch_folder() + "tokens.pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  Failure problem;
  EXPECT_FALSE(read_login_file(pipe, true, problem));
  EXPECT_EQ(problem.text, "'" + pipe + "' is no regular file");
  std::thread writer([&] { std::ofstream{pipe} << kToken; });
  const auto read = read_login_file(pipe, false, problem);
  writer.join();
  EXPECT_EQ(read, kToken);
}

// Two refreshes: the writer of the file must be done.
Refreshed looks(Authenticator& method) {
  const Refreshed first = method.refresh(kEarly);
  EXPECT_THAT(first.changes, IsEmpty());
  EXPECT_THAT(first.problems, IsEmpty());
  return method.refresh(kEarly);
}

// A machine without a battery for its clock, before it has reached a time server.
TEST(Authenticator, AClockThatIsBehindMakesNoTokenValidAgain) {
  AuthOptions options;
  options.token_file = write_file("ended.yaml", token_entry("anna", ", expires: 2026-02-01"));
  const timespec written[2] = {{1772323200, 0}, {1772323200, 0}};  // 2026-03-01
  ASSERT_EQ(::utimensat(AT_FDCWD, options.token_file.c_str(), written, 0), 0);
  const AuthSetup setup = make_authenticator(options, kEarly);
  EXPECT_THAT(
      check(*setup.authenticator, kToken, "1.1.1.1:1").reason,
      AllOf(HasSubstr("expired"), HasSubstr("its file was written at 2026-03-01T00:00:00Z")));
}

// An archive or a copy gives the file the time of another clock.
TEST(Authenticator, AFileFromTheFutureEndsNoToken) {
  const std::time_t seconds = std::time(nullptr);
  constexpr std::time_t kDay = 24 * 60 * 60;
  const Stamp now = static_cast<Stamp>(seconds) * kStampSecond;
  AuthOptions options;
  options.token_file = write_file(
      "ahead.yaml", token_entry("anna", ", expires: " + date_text(now + 30 * kDay * kStampSecond)));
  const timespec written[2] = {{seconds + 365 * kDay, 0}, {seconds + 365 * kDay, 0}};
  ASSERT_EQ(::utimensat(AT_FDCWD, options.token_file.c_str(), written, 0), 0);
  const AuthSetup setup = make_authenticator(options, now);
  ASSERT_THAT(setup.problems, IsEmpty());
  const std::string token = kToken;
  const Attempt attempt{"token", Bytes(token.begin(), token.end()), "1.1.1.1:1"};
  EXPECT_TRUE(setup.authenticator->judge(attempt, now).identity);
}

// A token that was withdrawn must not stay valid until the file changes once more.
TEST(Authenticator, AFileThatCannotBeReadForAWhileIsReadAfterwards) {
  if (!test::NoDescriptors::kPossible) GTEST_SKIP() << "the sanitizer needs descriptors";
  AuthOptions options;
  options.token_file = write_file("passing.yaml", token_entry("anna"));
  const AuthSetup setup = make_authenticator(options, kEarly);
  Authenticator& method = *setup.authenticator;
  write_file("passing.yaml", "another-token-0123456789");
  {
    const test::NoDescriptors none;
    EXPECT_THAT(looks(method).problems, ElementsAre(HasSubstr("Too many open files")));
    EXPECT_TRUE(method.refresh(kEarly).lacks_means);
    EXPECT_TRUE(method.refresh(kEarly).lacks_means);
    EXPECT_THAT(looks(method).problems, IsEmpty());  // said once
    EXPECT_TRUE(check(method, kToken, "1.1.1.1:1").identity.has_value());
  }
  EXPECT_EQ(looks(method).changes.size(), 1U);
  EXPECT_FALSE(method.refresh(kEarly).lacks_means);
  EXPECT_FALSE(check(method, kToken, "1.1.1.1:1").identity.has_value());
  write_file("passing.yaml", "short");
  EXPECT_THAT(looks(method).problems, Not(IsEmpty()));
  EXPECT_FALSE(method.refresh(kEarly).lacks_means);  // wrong, not unreadable
}

// Nobody reads it before it appears.
TEST(Authenticator, AFileThatIsMissingRefusesNobodyOnceDescriptorsAreBack) {
  if (!test::NoDescriptors::kPossible) GTEST_SKIP() << "the sanitizer needs descriptors";
  AuthOptions options;
  options.token_file = write_file("gone.yaml", token_entry("anna"));
  const AuthSetup setup = make_authenticator(options, kEarly);
  Authenticator& method = *setup.authenticator;
  ::unlink(options.token_file.c_str());
  {
    const test::NoDescriptors none;
    EXPECT_THAT(looks(method).problems, Not(IsEmpty()));
    EXPECT_TRUE(method.refresh(kEarly).lacks_means);
  }
  EXPECT_FALSE(method.refresh(kEarly).lacks_means);
}

TEST(TokenLogin, AFileThatCannotBeReadAtOnceIsReadAtARefresh) {
  if (!test::NoDescriptors::kPossible) GTEST_SKIP() << "the sanitizer needs descriptors";
  const std::string file = write_file("at_once.yaml", token_entry("anna"));
  std::vector<Failure> problems;
  std::vector<std::string> warnings;
  FileWatch watch(file);
  TokenLogin method(read_token_file(file, true, kEarly, problems, warnings), watch);
  write_file("at_once.yaml", "another-token-0123456789");
  {
    const test::NoDescriptors none;
    EXPECT_THAT(method.read_again(kEarly).problems, ElementsAre(HasSubstr("Too many open files")));
    EXPECT_TRUE(method.refresh(kEarly).lacks_means);
  }
  EXPECT_EQ(method.refresh(kEarly).changes.size(), 1U);
  EXPECT_FALSE(method.refresh(kEarly).lacks_means);
  EXPECT_FALSE(check(method, kToken, "1.1.1.1:1").identity.has_value());
}

TEST(Authenticator, FollowsItsFileWholeOrNotAtAll) {
  AuthOptions options;
  options.token_file = write_file("followed.yaml", token_entry("anna"));
  const AuthSetup setup = make_authenticator(options, kEarly);
  Authenticator& method = *setup.authenticator;
  EXPECT_THAT(looks(method).news, IsEmpty());
  write_file("followed.yaml", token_entry("anna", ", groups: [ops]"));
  const Refreshed more = looks(method);
  ASSERT_EQ(more.changes.size(), 1U);
  EXPECT_THAT(more.changes[0].identity.value().groups, ElementsAre("ops"));
  EXPECT_THAT(more.news, ElementsAre(HasSubstr("1 tokens, 0 withdrawn, 1 with changed rights")));
  EXPECT_THAT(looks(method).news, IsEmpty());  // once
  for (const std::string& wrong : {token_entry("anna") + "- {identity: bert}\n", std::string{}}) {
    write_file("followed.yaml", wrong);
    const Refreshed refused = looks(method);
    EXPECT_THAT(refused.problems, testing::Not(IsEmpty()));
    EXPECT_THAT(refused.changes, IsEmpty());
    EXPECT_THAT(check(method, kToken, "1.1.1.1:1").identity.value().groups, ElementsAre("ops"));
  }
  ::unlink(options.token_file.c_str());
  EXPECT_THAT(looks(method).problems, ElementsAre(HasSubstr("No such file")));
  write_file("followed.yaml", "another-token-0123456789");
  const Refreshed withdrawn = looks(method);
  ASSERT_EQ(withdrawn.changes.size(), 1U);
  EXPECT_FALSE(withdrawn.changes[0].identity.has_value());
  EXPECT_FALSE(check(method, kToken, "1.1.1.1:1").identity.has_value());
}

// Behind a reverse proxy all have one address.
TEST(Authenticator, ARightTokenGetsInWhateverOthersOfItsAddressTry) {
  AuthOptions options;
  options.token = kToken;
  const AuthSetup setup = make_authenticator(options, kEarly);
  for (int i = 0; i < 1000; ++i)
    EXPECT_EQ(check(*setup.authenticator, "wrong", "127.0.0.1:1").reason, "unknown token");
  EXPECT_TRUE(check(*setup.authenticator, kToken, "127.0.0.1:2").identity.has_value());
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

TEST(Credential, FollowsItsFile) {
  CredentialOptions options;
  options.token_file = write_file("followed.token", "the-first-of-tokens\n");
  CredentialFile file(options);
  EXPECT_FALSE(file.changed());
  write_file("followed.token", "the-second-of-tokens\n");
  EXPECT_FALSE(file.changed());  // its writer may not be done
  const auto second = file.changed();
  ASSERT_TRUE(second.has_value());
  EXPECT_EQ(std::string(second->bytes.begin(), second->bytes.end()), "the-second-of-tokens");
  EXPECT_FALSE(file.changed());
  write_file("followed.token", "short");
  EXPECT_FALSE(file.changed());
  EXPECT_THAT(file.changed().value().problems, ElementsAre(HasSubstr("5 characters")));
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
  EXPECT_THAT(two.warnings, ElementsAre(HasSubstr("chmod go-r")));
  options.token_file = write_file("wide.token", {"\xff\xfet\0o\0k\0e\0n\0\r\0\n\0", 16});
  EXPECT_THAT(client_credential(options).problems, ElementsAre(HasSubstr("UTF-16")));
  options.token_file = test::scratch_folder();
  EXPECT_THAT(client_credential(options).problems, ElementsAre(HasSubstr("directory")));
}

}  // namespace
}  // namespace connect_bridge
