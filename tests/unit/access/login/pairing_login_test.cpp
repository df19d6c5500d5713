#include "access/login/pairing_login.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "core/base/hex.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr char kCode[] = "00112233445566778899aabbccddeeff";
constexpr char kPairedToken[] = "a-token-of-the-clients-own";
constexpr Stamp kPairingNow = 1'900'000'000'000'000'000;

Bytes bytes(const std::string& text) {
  return {text.begin(), text.end()};
}

Digest digest_of(const std::string& token) {
  return sha256(bytes(token));
}

class Pairing : public testing::Test {
 protected:
  Pairing() {
    static int number = 0;
    file_ = test::scratch_folder() + "tokens" + std::to_string(++number) + ".yaml";
    std::ofstream{file_} << "# nobody yet\n";
    ::chmod(file_.c_str(), 0600);
  }

  void start(PairingOptions pairing) {
    AuthOptions options;
    options.token_file = file_;
    options.pairing = std::move(pairing);
    AuthSetup setup = make_authenticator(options, kPairingNow);
    ASSERT_THAT(setup.problems, IsEmpty());
    login_ = std::move(setup.authenticator);
  }
  void invite(const std::string& code, const std::vector<std::string>& groups = {"paired"}) {
    EXPECT_EQ(write_invited(invited(), code, groups), "");
  }
  void open(std::chrono::steady_clock::duration lifetime = std::chrono::minutes(10)) {
    start({.file = invited(), .lifetime = lifetime});
    invite(kCode);
  }
  [[nodiscard]] std::string invited() const { return file_ + ".invited"; }

  Judgement pair(const std::string& code, const std::string& token, Stamp now = kPairingNow,
                 const std::string& name = "laptop") {
    return show(pairing_credential(code, digest_of(token), name), now);
  }
  Judgement show(const std::string& credential, Stamp now = kPairingNow) {
    return login_->judge({kPairingLogin, bytes(credential), "192.0.2.7:5123"}, now);
  }
  Judgement log_in(const std::string& token) {
    return login_->judge({"token", bytes(token), "192.0.2.7:5124"}, kPairingNow);
  }
  [[nodiscard]] std::string content() const {
    std::ifstream in(file_);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  std::string file_;
  std::unique_ptr<Authenticator> login_;
};

// A line on stderr would name who is waited for longer.
TEST_F(Pairing, WhoHoldsTheFolderLockedHoldsUpNoOtherLoginForLong) {
  open();
  const int held = ::open(test::scratch_folder().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  ASSERT_EQ(::flock(held, LOCK_EX), 0);
  testing::internal::CaptureStderr();
  EXPECT_THAT(pair(kCode, kPairedToken).reason, HasSubstr("holds its folder locked"));
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  ::close(held);
  EXPECT_TRUE(pair(kCode, kPairedToken).identity.has_value());
}

TEST_F(Pairing, TheClientsOwnTokenLogsItInFromThenOn) {
  open();
  EXPECT_FALSE(log_in(kPairedToken).identity);
  const Judgement paired = pair(kCode, kPairedToken);
  ASSERT_TRUE(paired.identity) << paired.reason;
  EXPECT_EQ(paired.identity->name, "paired/laptop");
  EXPECT_THAT(paired.identity->groups, ElementsAre("paired"));
  const Judgement later = log_in(kPairedToken);
  ASSERT_TRUE(later.identity);
  // The same credential, so that withdrawing the token ends this link too.
  EXPECT_EQ(later.identity->credential, paired.identity->credential);
  EXPECT_THAT(login_->refresh(kPairingNow).news,
              ElementsAre(HasSubstr("paired with 'paired/laptop'")));
}

// Where the invitation could not be printed.
TEST_F(Pairing, AnInvitationThatWasWrittenGoesWhenItIsOfNoMoreUse) {
  const std::string shown = file_ + ".shown";
  const auto write = [&] { std::ofstream{shown} << kCode; };
  const auto is_there = [&] { return ::access(shown.c_str(), F_OK) == 0; };
  write();
  start({.file = invited(), .shown = shown});
  EXPECT_FALSE(is_there());  // of the start before
  invite(kCode);
  write();
  EXPECT_FALSE(pair("another", kPairedToken).identity);
  EXPECT_TRUE(is_there());
  EXPECT_TRUE(pair(kCode, kPairedToken).identity);
  EXPECT_FALSE(is_there());
  start({.file = invited(), .shown = shown, .lifetime = {}});
  invite(kCode);
  write();
  EXPECT_THAT(login_->refresh(kPairingNow).news, Not(IsEmpty()));
  EXPECT_FALSE(is_there());
}

TEST_F(Pairing, TheFileHasTheHashAloneAndIsItsOwnersAlone) {
  open();
  ASSERT_TRUE(pair(kCode, kPairedToken).identity);
  EXPECT_THAT(content(), HasSubstr(to_hex(digest_of(kPairedToken))));
  EXPECT_THAT(content(), Not(HasSubstr(kPairedToken)));
  EXPECT_THAT(content(), Not(HasSubstr(kCode)));
  struct stat status {};
  ASSERT_EQ(::stat(file_.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0600U);
  // And a server that starts without a pairing reads it.
  AuthOptions options;
  options.token_file = file_;
  EXPECT_THAT(make_authenticator(options, kPairingNow).problems, IsEmpty());
}

TEST_F(Pairing, ASecondClientIsRefusedAndTheFirstMayAskAgain) {
  open();
  ASSERT_TRUE(pair(kCode, kPairedToken).identity);
  EXPECT_THAT(pair(kCode, "a-token-of-somebody-else").reason, HasSubstr("used up"));
  EXPECT_TRUE(pair(kCode, kPairedToken).identity);  // the answer to its first login was lost
  EXPECT_FALSE(log_in("a-token-of-somebody-else").identity);
}

TEST_F(Pairing, ItEndsInTime) {
  open(std::chrono::milliseconds(0));
  EXPECT_THAT(pair(kCode, kPairedToken).reason, HasSubstr("no pairing is open"));
  EXPECT_THAT(login_->refresh(kPairingNow).news, ElementsAre(HasSubstr("in time")));
  EXPECT_THAT(login_->refresh(kPairingNow).news, IsEmpty());  // said once
  EXPECT_FALSE(pair(kCode, kPairedToken).identity);
  EXPECT_EQ(content(), "# nobody yet\n");
}

TEST_F(Pairing, WrongCodesOfOthersDoNotEndIt) {
  open();
  std::string wrong = kCode;
  wrong.back() = '0';
  for (unsigned i = 0; i < 1000; ++i) EXPECT_FALSE(pair(wrong, kPairedToken).identity);
  EXPECT_THAT(login_->refresh(kPairingNow).news, IsEmpty());
  EXPECT_TRUE(pair(kCode, kPairedToken).identity);
  EXPECT_THAT(show(std::string{}).reason, HasSubstr("not a credential of a pairing"));
}

TEST_F(Pairing, WhatIsNoCredentialOfAPairingIsRefused) {
  open();
  const std::string digest = to_hex(digest_of(kPairedToken));
  const std::string code = kCode;
  for (const std::string& wrong :
       {std::string{}, code, code + " " + digest, code + " " + digest + " ",
        code + " " + digest.substr(1) + " laptop", code + " " + digest + " lap top",
        code + " " + digest + " a\nb", code + " " + digest + " " + std::string(65, 'a'),
        " " + digest + " laptop"})
    EXPECT_FALSE(show(wrong).identity) << wrong;
  EXPECT_EQ(content(), "# nobody yet\n");
  EXPECT_TRUE(pair(code, kPairedToken).identity);
}

// On a robot without a battery-backed clock the time may be set during the pairing.
TEST_F(Pairing, ItGoesByNoClockThatIsSet) {
  constexpr Stamp kYear = Stamp{365} * 86'400'000'000'000;
  open();
  EXPECT_THAT(login_->refresh(kPairingNow + kYear).news, IsEmpty());
  EXPECT_TRUE(pair(kCode, kPairedToken, kPairingNow + kYear).identity);
}

TEST_F(Pairing, AKnownNameGetsANumberAndTheOthersStay) {
  std::ofstream{file_} << "- {identity: paired/laptop, token_sha256: "
                       << to_hex(digest_of("token-of-before-0123456789")) << "}\n";
  ::chmod(file_.c_str(), 0600);
  open();
  EXPECT_EQ(pair(kCode, kPairedToken).identity.value().name, "paired/laptop-2");
  EXPECT_THAT(
      login_->refresh(kPairingNow).news,
      ElementsAre(AllOf(HasSubstr("paired with 'paired/laptop-2'"),
                        HasSubstr("ctl token paired/laptop --remove --file '" + file_ + "'"))));
  EXPECT_EQ(log_in("token-of-before-0123456789").identity.value().name, "paired/laptop");
}

// It stands before their names, and rules may be for it.
TEST_F(Pairing, ARobotsIdentityIsANameForRosThatNobodyHas) {
  PairingOptions options{.file = invited()};
  options.of_robots = true;
  options.taken = {"arm_1_2"};
  start(options);
  for (const auto& [name, expected] :
       {std::pair{"arm-1", "arm_1"}, {"arm.1", "arm_1_3"}, {"7", "robot7"}, {"7", "robot7_2"}}) {
    invite(kCode);
    EXPECT_EQ(
        pair(kCode, kPairedToken + std::string(expected), kPairingNow, name).identity.value().name,
        expected);
  }
}

TEST_F(Pairing, ARunningServerTakesAnInvitation) {
  start({invited()});
  EXPECT_THAT(pair(kCode, kPairedToken).reason, HasSubstr("no pairing is open"));
  invite(kCode, {"paired", "operators"});
  EXPECT_THAT(login_->refresh(kPairingNow).news, IsEmpty());
  EXPECT_FALSE(std::filesystem::exists(invited()));
  EXPECT_THAT(pair(kCode, kPairedToken).identity.value().groups,
              ElementsAre("paired", "operators"));
}

TEST_F(Pairing, TheNextInvitationTakesThePlaceOfTheLast) {
  open();
  ASSERT_TRUE(pair(kCode, kPairedToken).identity);
  const std::string next = "ffeeddccbbaa99887766554433221100";
  invite(next);
  const std::string other = "a-token-of-somebody-else";
  EXPECT_FALSE(pair(kCode, other).identity);
  EXPECT_EQ(pair(next, other).identity.value().name, "paired/laptop-2");
  EXPECT_TRUE(log_in(kPairedToken).identity);
}

// Its time would begin now, which may be days later.
TEST_F(Pairing, AnInvitationThatNobodyTookIsVoidAtTheNextStart) {
  invite(kCode);
  start({invited()});
  EXPECT_FALSE(std::filesystem::exists(invited()));
  EXPECT_FALSE(pair(kCode, kPairedToken).identity);
}

TEST_F(Pairing, WhatIsNoInvitationInvitesNobody) {
  start({invited()});
  for (const char* text : {"", "\n", "00 paired\n", kCode}) {
    std::ofstream{invited()} << text;
    EXPECT_THAT(login_->refresh(kPairingNow).problems, ElementsAre(HasSubstr("not an invitation")));
    EXPECT_FALSE(pair(kCode, kPairedToken).identity) << text;
  }
}

TEST_F(Pairing, WhoElseMayWriteAnInvitationInvitesNobody) {
  start({invited()});
  invite(kCode);
  ::chmod(invited().c_str(), 0602);
  EXPECT_THAT(login_->refresh(kPairingNow).problems, ElementsAre(HasSubstr("may change")));
  EXPECT_FALSE(pair(kCode, kPairedToken).identity);
}

// It would be taken again and again, each time with new time.
TEST_F(Pairing, AnInvitationThatStaysIsNotTakenAndThatIsSaidOnce) {
  start({.file = invited(), .lifetime = std::chrono::minutes(10)});
  std::filesystem::create_directory(invited());
  EXPECT_THAT(login_->refresh(kPairingNow).problems,
              ElementsAre(HasSubstr("cannot be removed: Is a directory")));
  EXPECT_THAT(login_->refresh(kPairingNow).problems, IsEmpty());
  std::filesystem::remove(invited());
  invite(kCode);
  EXPECT_TRUE(pair(kCode, kPairedToken).identity);
}

TEST_F(Pairing, AFileThatCannotBeWrittenPairsNobody) {
  open();
  std::ofstream{file_} << "- {identity: somebody}\n";  // not valid, so nothing is added to it
  EXPECT_THAT(pair(kCode, kPairedToken).reason, HasSubstr("cannot be stored"));
  EXPECT_THAT(login_->refresh(kPairingNow).problems, ElementsAre(HasSubstr("the pairing failed")));
  EXPECT_FALSE(log_in(kPairedToken).identity);
}

TEST(PairingName, IsWhatAHostMayBeCalled) {
  EXPECT_EQ(pairing_name("anna's laptop"), "anna-s-laptop");
  EXPECT_EQ(pairing_name(""), "client");
  EXPECT_EQ(pairing_name(std::string(100, 'x')).size(), 64U);
}

}  // namespace
}  // namespace connect_bridge
