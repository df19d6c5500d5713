#include "access/login/plugin_login.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>

#include "unit/scratch.hpp"

namespace connect_bridge {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

const std::string kFolder = CONNECT_PLUGINS;
constexpr Stamp kNow = 1'000'000'000'000;

struct Loaded {
  explicit Loaded(const std::string& name, const std::string& options = "anna:a-password")
      : setup(PluginLogin::load(name.front() == '/' ? name : kFolder + name,
                                {{"plugin_options", options}})) {}
  [[nodiscard]] Judgement judge(const std::string& credential) const {
    return setup.authenticator->judge(
        {"plugin", Bytes(credential.begin(), credential.end()), "1.1.1.1:1"}, kNow);
  }
  [[nodiscard]] std::string problem() const {
    EXPECT_EQ(setup.authenticator == nullptr, setup.problems.size() == 1);
    return setup.problems.empty() ? "" : setup.problems[0];
  }
  AuthSetup setup;
};

TEST(PluginLogin, SaysWhoItIs) {
  const Loaded example("auth_plugin.so");
  ASSERT_EQ(example.problem(), "");
  EXPECT_EQ(example.setup.authenticator->threads(), 4U);
  const Judgement anna = example.judge("anna:a-password");
  ASSERT_TRUE(anna.identity.has_value());
  EXPECT_EQ(anna.identity->name, "anna");
  EXPECT_THAT(anna.identity->groups, ElementsAre("plugin"));
  EXPECT_EQ(anna.identity->expires, kNow + 3600LL * 1'000'000'000);
  EXPECT_EQ(anna.identity->credential, "");
  for (const char* wrong : {"", "anna", "anna:a-passwore", "anna:a-password "}) {
    EXPECT_EQ(example.judge(wrong).reason, "plugin: wrong name or password");
    EXPECT_TRUE(example.judge(wrong).judged);
  }
  EXPECT_FALSE(example.setup.authenticator->judge({"token", {}, ""}, kNow).identity.has_value());
  EXPECT_THAT(example.setup.authenticator->refresh(kNow).news, IsEmpty());
}

TEST(PluginLogin, RefusesWhatIsNoAnswer) {
  const Loaded odd("odd_plugin.so");
  ASSERT_EQ(odd.problem(), "");
  EXPECT_EQ(odd.judge("fine").identity.value().credential, "key 1");
  for (const char* wrong : {"name is empty", "control", "long", "expires", "groups", "proof", "7",
                            "unjudged", "reason"})
    EXPECT_FALSE(odd.judge(wrong).identity.has_value()) << wrong;
  EXPECT_THAT(odd.judge("reason").reason, Not(HasSubstr("\033")));
}

// An outage, or an answer that means nothing, makes no client a guesser of passwords.
TEST(PluginLogin, WhatItCouldNotJudgeIsNoWrongLogin) {
  const Loaded odd("odd_plugin.so");
  EXPECT_FALSE(odd.judge("unjudged").judged);
  EXPECT_FALSE(odd.judge("7").judged);
  EXPECT_TRUE(odd.judge("reason").judged);
}

TEST(PluginLogin, EndsLoginsWhoseProofItWithdraws) {
  const Loaded odd("odd_plugin.so");
  const Refreshed told = odd.setup.authenticator->refresh(kNow);
  ASSERT_EQ(told.changes.size(), 1U) << "none for logins that rest on nothing";
  EXPECT_EQ(told.changes[0].credential, odd.judge("fine").identity.value().credential);
  EXPECT_FALSE(told.changes[0].identity.has_value());
  EXPECT_THAT(told.news, ElementsAre("one key left"));
  ASSERT_EQ(told.warnings.size(), 1U);
  EXPECT_LE(told.warnings[0].size(), 600U);
  EXPECT_THAT(told.warnings[0], Not(HasSubstr("\033")));
}

TEST(PluginLogin, IsRefusedAtTheStartWithTheReason) {
  EXPECT_THAT(Loaded("auth_plugin.so", "no colon").problem(),
              HasSubstr("does not start: expected NAME:PASSWORD"));
  EXPECT_THAT(Loaded("odd_plugin.so", "long").problem(), Not(HasSubstr("\033")));
  EXPECT_THAT(Loaded("odd_plugin.so", "silent").problem(), HasSubstr("does not say why"));
  EXPECT_THAT(Loaded("late_plugin.so").problem(), HasSubstr("version 3 of the interface"));
  EXPECT_THAT(Loaded("idle_plugin.so").problem(), HasSubstr("does not set what"));
  EXPECT_THAT(Loaded("nowhere.so").problem(), HasSubstr("nowhere.so"));
}

}  // namespace
}  // namespace connect_bridge
