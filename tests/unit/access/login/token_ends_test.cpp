// Tokens that end soon: told in time, to those who can make new ones.
#include "access/login/token_ends.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>

#include "access/login/authenticator.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr Stamp kEndsDay = 24 * 3600 * kStampSecond;
constexpr Stamp kEndsHour = 3600 * kStampSecond;
constexpr Stamp kEndsNow = 20'795 * kEndsDay;  // 2026-12-08

// An entry of a token file whose token ends so many days after kEndsNow.
std::string entry_ending(const std::string& name, double days, int number) {
  const auto after = static_cast<Stamp>(days * static_cast<double>(kEndsDay));
  std::string digest = std::to_string(number);
  digest.insert(0, 64 - digest.size(), 'a');
  return "- {identity: " + name + ", token_sha256: " + digest +
         ", expires: " + date_text(kEndsNow + after) + "}\n";
}

std::string entry_without_end(const std::string& name) {
  return "- {identity: " + name + ", token_sha256: " + std::string(64, 'b') + "}\n";
}

TokenTable table_of(const std::string& text) {
  TokenTable table;
  std::vector<std::string> problems, warnings;
  table.read(text, "tokens.yaml", kEndsNow, problems, warnings);
  EXPECT_THAT(problems, IsEmpty());
  return table;
}

// What is told by one that has told nothing yet.
std::string told_first(const TokenTable& table, Stamp now = kEndsNow) {
  return TokenEnds{}.take_line(table, "tokens.yaml", now).value_or("");
}

TEST(TokenEnds, AreToldFromFourteenDaysBefore) {
  const TokenTable table = table_of(entry_ending("late", 14.5, 1) + entry_ending("bert", 12, 2) +
                                    entry_ending("anna", 3.5, 3) + entry_ending("gone", -1, 4) +
                                    entry_without_end("ever"));
  EXPECT_EQ(told_first(table),
            "tokens.yaml: tokens end within 14 days: 'anna' (2026-12-11T12:00:00Z), "
            "'bert' (2026-12-20T00:00:00Z): make new ones (ctl token)");
  EXPECT_THAT(told_first(table, kEndsNow + kEndsDay), HasSubstr("'late'"));
  EXPECT_THAT(told_first(table, kEndsNow + 4 * kEndsDay), Not(HasSubstr("'anna'")));
  EXPECT_EQ(told_first(table, kEndsNow - 30 * kEndsDay), "");
  EXPECT_EQ(told_first(table_of(entry_without_end("ever"))), "");
}

TEST(TokenEnds, AnIdentityIsNamedOnceWithItsFirstEnd) {
  EXPECT_EQ(told_first(table_of(entry_ending("anna", 9, 1) + entry_ending("anna", 2, 2))),
            "tokens.yaml: tokens end within 14 days: 'anna' (2026-12-10T00:00:00Z): make new ones "
            "(ctl token)");
}

// The code of a robot's line is used, or of no use, before anybody could make another one.
TEST(TokenEnds, WhatWorksOnceNeedsNone) {
  std::string line = entry_ending("robot7", 1, 1);
  line.insert(line.size() - 2, ", groups: [line]");
  const TokenTable table = table_of(line + entry_ending("anna", 2, 2));
  EXPECT_THAT(told_first(table), HasSubstr("'robot7'"));
  const auto told = TokenEnds("line").take_line(table, "tokens.yaml", kEndsNow);
  EXPECT_THAT(told.value_or(""), AllOf(HasSubstr("'anna'"), Not(HasSubstr("'robot7'"))));
}

TEST(TokenEnds, WhoHasALaterOneNeedsNone) {
  const std::string ends = entry_ending("anna", 2, 1);
  EXPECT_EQ(told_first(table_of(ends + entry_ending("anna", 90, 2))), "");
  EXPECT_THAT(told_first(table_of(ends + entry_ending("anna", 90, 2) + entry_ending("bert", 3, 3))),
              AllOf(HasSubstr("'bert'"), Not(HasSubstr("'anna'"))));
}

TEST(TokenEnds, AtMostTenAreNamed) {
  std::string text;
  for (int i = 1; i <= 10; ++i) text += entry_ending("user" + std::to_string(i), 0.5 * i, i);
  EXPECT_THAT(told_first(table_of(text)), AllOf(HasSubstr("'user10'"), Not(HasSubstr("more"))));
  text += entry_ending("last", 13, 11) + entry_ending("later", 12, 12);
  EXPECT_THAT(told_first(table_of(text)),
              AllOf(HasSubstr("'user1' (2026-12-08T12:00:00Z)"), HasSubstr("'user10'"),
                    Not(HasSubstr("'last'")), EndsWith(" and 2 more: make new ones (ctl token)")));
}

TEST(TokenEnds, AreToldOnceADay) {
  const TokenTable table = table_of(entry_ending("anna", 10, 1));
  TokenEnds ends;
  const auto tells = [&](Stamp now) {
    return ends.take_line(table, "tokens.yaml", now).has_value();
  };
  EXPECT_FALSE(tells(kEndsNow - 5 * kEndsDay));
  EXPECT_TRUE(tells(kEndsNow));
  EXPECT_FALSE(tells(kEndsNow + kStampSecond));
  EXPECT_FALSE(tells(kEndsNow + 23 * kEndsHour));
  EXPECT_TRUE(tells(kEndsNow + 24 * kEndsHour));
  EXPECT_FALSE(tells(kEndsNow + 25 * kEndsHour));
  EXPECT_TRUE(tells(kEndsNow)) << "the clock was set back";
  EXPECT_FALSE(tells(kEndsNow + kEndsHour));
  ends.tell_again();
  EXPECT_TRUE(tells(kEndsNow + kEndsHour));
}

// ---- with a file

class TokenEndsOfAFile : public testing::Test {
 protected:
  TokenEndsOfAFile() {
    static int number = 0;
    file_ = test::scratch_folder() + "ending" + std::to_string(++number) + ".yaml";
  }
  void write(const std::string& text) const {
    std::ofstream{file_} << text;
    ::chmod(file_.c_str(), 0600);
  }
  void start() {
    AuthOptions options;
    options.token_file = file_;
    AuthSetup setup = make_authenticator(options, kEndsNow);
    ASSERT_THAT(setup.problems, IsEmpty());
    EXPECT_THAT(setup.warnings, IsEmpty());
    login_ = std::move(setup.authenticator);
  }
  // What the server says when it looks at the file at that time.
  [[nodiscard]] Refreshed look(Stamp now) const { return login_->refresh(now); }

  std::string file_;
  std::unique_ptr<Authenticator> login_;
};

TEST_F(TokenEndsOfAFile, AreToldAtTheStartAndWhenTheFileIsReadAgain) {
  write(entry_ending("anna", 10, 1));
  start();
  EXPECT_THAT(look(kEndsNow).warnings,
              ElementsAre("auth.token_file '" + file_ +
                          "': tokens end within 14 days: 'anna' (2026-12-18T00:00:00Z): make new "
                          "ones (ctl token)"));
  EXPECT_THAT(look(kEndsNow + kStampSecond).warnings, IsEmpty());
  write(entry_ending("anna", 10, 1) + entry_ending("bert", 1, 2));
  EXPECT_THAT(look(kEndsNow + 2 * kStampSecond).warnings, IsEmpty());  // its writer may not be done
  const Refreshed read = look(kEndsNow + 3 * kStampSecond);
  EXPECT_THAT(read.news, ElementsAre(HasSubstr("was read again: 2 tokens")));
  EXPECT_THAT(read.warnings, ElementsAre(HasSubstr("'bert' (2026-12-09T00:00:00Z), 'anna'")));
  EXPECT_THAT(look(kEndsNow + 4 * kStampSecond).warnings, IsEmpty());
  write(entry_ending("anna", 90, 1));
  for (int i = 5; i < 7; ++i) EXPECT_THAT(look(kEndsNow + i * kStampSecond).warnings, IsEmpty());
  EXPECT_THAT(look(kEndsNow + 80 * kEndsDay).warnings, ElementsAre(HasSubstr("'anna'")));
}

TEST_F(TokenEndsOfAFile, AreToldOnWhileTheFileCannotBeUsed) {
  write(entry_ending("anna", 10, 1));
  start();
  EXPECT_THAT(look(kEndsNow).warnings, ElementsAre(HasSubstr("'anna'")));
  write("- {identity: bert}\n");
  for (int i = 1; i < 5; ++i) EXPECT_THAT(look(kEndsNow + i * kStampSecond).warnings, IsEmpty());
  EXPECT_THAT(look(kEndsNow + kEndsDay).warnings, ElementsAre(HasSubstr("'anna'")));
}

TEST_F(TokenEndsOfAFile, AreToldWhileAClientMayPair) {
  write(entry_ending("anna", 10, 1));
  AuthOptions options;
  options.token_file = file_;
  options.pairing = PairingOptions{file_ + ".invited"};
  login_ = make_authenticator(options, kEndsNow).authenticator;
  ASSERT_TRUE(login_);
  EXPECT_THAT(look(kEndsNow).warnings, ElementsAre(HasSubstr("'anna'")));
}

}  // namespace
}  // namespace connect_bridge
