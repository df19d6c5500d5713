#include "auth/plugin_login.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>

#include "unit/scratch.hpp"

namespace connect_bridge {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

const std::string kFolder = CONNECT_PLUGINS;
constexpr Stamp kNow = 1'000'000'000'000;

struct Loaded {
  explicit Loaded(const std::string& name, const std::string& options = "anna:a-password")
      : method(PluginLogin::load(name.front() == '/' ? name : kFolder + name, options, problem)) {}
  [[nodiscard]] Judgement judge(const std::string& credential) const {
    return method->judge({"plugin", Bytes(credential.begin(), credential.end()), "1.1.1.1:1"},
                         kNow);
  }
  std::string problem;
  std::unique_ptr<PluginLogin> method;
};

TEST(PluginLogin, SaysWhoItIs) {
  const Loaded example("auth_plugin.so");
  ASSERT_EQ(example.problem, "");
  const Judgement anna = example.judge("anna:a-password");
  ASSERT_TRUE(anna.identity.has_value());
  EXPECT_EQ(anna.identity->name, "anna");
  EXPECT_THAT(anna.identity->groups, ElementsAre("plugin"));
  EXPECT_EQ(anna.identity->expires, kNow + 3600LL * 1'000'000'000);
  for (const char* wrong : {"", "anna", "anna:a-passwore", "anna:a-password "})
    EXPECT_EQ(example.judge(wrong).reason, "plugin: wrong name or password");
  EXPECT_FALSE(example.method->judge({"token", {}, ""}, kNow).identity.has_value());
}

TEST(PluginLogin, RefusesWhatIsNoAnswer) {
  const Loaded odd("odd_plugin.so");
  ASSERT_EQ(odd.problem, "");
  EXPECT_TRUE(odd.judge("fine").identity.has_value());
  for (const char* wrong : {"name is empty", "control", "long", "expires", "groups", "2", "reason"})
    EXPECT_FALSE(odd.judge(wrong).identity.has_value()) << wrong;
  EXPECT_THAT(odd.judge("reason").reason, testing::Not(HasSubstr("\033")));
}

TEST(PluginLogin, IsRefusedAtTheStartWithTheReason) {
  EXPECT_THAT(Loaded("auth_plugin.so", "no colon").problem,
              HasSubstr("does not start: expected NAME:PASSWORD"));
  EXPECT_THAT(Loaded("odd_plugin.so", "full").problem, HasSubstr("does not start: xxx"));
  EXPECT_THAT(Loaded("late_plugin.so").problem, HasSubstr("version 2 of the interface"));
  EXPECT_THAT(Loaded("nowhere.so").problem, HasSubstr("nowhere.so"));
  const std::string open = test::scratch_folder() + "open.so";
  std::filesystem::copy_file(kFolder + "auth_plugin.so", open);
  ::chmod(open.c_str(), 0666);
  EXPECT_THAT(Loaded(open).problem, HasSubstr("may change"));
}

}  // namespace
}  // namespace connect_bridge
