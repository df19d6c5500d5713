#include "access/plugins/plugin.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

#include "access/login/plugin_login.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// Does what the credential says.
class Obedient : public Authenticator {
 public:
  Judgement judge(const Attempt& attempt, Stamp now) override {
    const std::string credential(attempt.credential.begin(), attempt.credential.end());
    if (credential == "throw") throw std::runtime_error("thrown");
    if (credential == "down") return {std::nullopt, "it is down", false};
    if (credential == "long") return {std::nullopt, std::string(10'000, 'x')};
    const std::vector<std::string> groups(CONNECT_BRIDGE_AUTH_GROUPS_MAX, std::string(255, 'g'));
    return {Identity{attempt.peer, groups, now + 1, "key"}, {}};
  }
  Refreshed refresh(Stamp now) override {
    if (now == 0) throw std::runtime_error("thrown");
    return {{{"key", std::nullopt}}, {"news"}, {"warning"}, {"problem"}};
  }
};

AuthSetup make(PluginOptions options) {
  if (options["how"] == "throw") throw std::runtime_error("thrown");
  AuthSetup setup;
  setup.warnings.push_back("a warning");
  if (options["how"] == "wrong") setup.problems = {"one", "two"};
  if (setup.problems.empty()) setup.authenticator = std::make_unique<Obedient>();
  return setup;
}

struct Told {
  std::vector<std::string> lines;
  connect_bridge_auth_report report{
      this,
      [](void* told, connect_bridge_auth_level level, const char* text) noexcept {
        static_cast<Told*>(told)->lines.push_back(std::to_string(level) + " " + text);
      },
      [](void* told, const char* proof) noexcept {
        static_cast<Told*>(told)->lines.push_back(std::string{"end "} + proof);
      }};
};

constexpr auto kFunctions = plugin_functions<&make>("obedient", 3);

struct Opened {
  explicit Opened(const char* how = "well") {
    const connect_bridge_auth_option option{"how", how};
    self = kFunctions.open(&option, 1, &told.report);
  }
  ~Opened() {
    if (self) kFunctions.close(self);
  }
  Opened(const Opened&) = delete;
  Opened& operator=(const Opened&) = delete;
  int judge(std::string_view credential) {
    *answer = {};
    const connect_bridge_auth_attempt attempt{
        reinterpret_cast<const std::uint8_t*>(credential.data()), credential.size(), "1.1.1.1:1",
        1000};
    return kFunctions.judge(self, &attempt, answer.get());
  }
  Told told;
  std::unique_ptr<connect_bridge_auth_answer> answer =
      std::make_unique<connect_bridge_auth_answer>();
  void* self = nullptr;
};

TEST(Plugin, GivesTheWholeIdentity) {
  Opened opened;
  ASSERT_NE(opened.self, nullptr);
  EXPECT_THAT(opened.told.lines, ElementsAre("1 a warning"));
  EXPECT_EQ(opened.judge("fine"), CONNECT_BRIDGE_AUTH_ACCEPTED);
  EXPECT_STREQ(opened.answer->identity, "1.1.1.1:1");
  EXPECT_STREQ(opened.answer->proof, "key");
  EXPECT_STREQ(opened.answer->groups[CONNECT_BRIDGE_AUTH_GROUPS_MAX - 1],
               std::string(255, 'g').c_str());
  EXPECT_EQ(opened.answer->expires, 1001);
}

TEST(Plugin, DoesNotJudgeWhatItCannot) {
  Opened opened;
  EXPECT_EQ(opened.judge("down"), CONNECT_BRIDGE_AUTH_UNJUDGED);
  EXPECT_STREQ(opened.answer->reason, "it is down");
  EXPECT_EQ(opened.judge("long"), CONNECT_BRIDGE_AUTH_REFUSED);
  EXPECT_EQ(std::string{opened.answer->reason}.size(), sizeof opened.answer->reason - 1);
}

TEST(Plugin, NoExceptionLeavesIt) {
  Opened opened;
  EXPECT_EQ(opened.judge("throw"), CONNECT_BRIDGE_AUTH_UNJUDGED);
  EXPECT_STREQ(opened.answer->reason, "thrown");
  opened.told.lines.clear();
  kFunctions.refresh(opened.self, 0, &opened.told.report);
  EXPECT_THAT(opened.told.lines, ElementsAre("2 thrown"));
  const Opened thrown("throw");
  EXPECT_EQ(thrown.self, nullptr);
  EXPECT_THAT(thrown.told.lines, ElementsAre("2 thrown"));
}

TEST(Plugin, TellsWhatHasChangedAndWhatIsWrong) {
  Opened opened;
  opened.told.lines.clear();
  kFunctions.refresh(opened.self, 1, &opened.told.report);
  EXPECT_THAT(opened.told.lines, ElementsAre("0 news", "1 warning", "2 problem", "end key"));
  const Opened wrong("wrong");
  EXPECT_EQ(wrong.self, nullptr);
  EXPECT_THAT(wrong.told.lines, ElementsAre("1 a warning", "2 one", "2 two"));
}

// ---- the libraries that are installed with the programs

TEST(OwnPlugins, AreBesideTheProgram) {
  AuthOptions options;
  options.method = "jwt";
  options.plugin_options = {{"jwt_keys", "/nowhere/keys"}};
  EXPECT_THAT(make_authenticator(options, 0).problems,
              ElementsAre(HasSubstr("auth_jwt.so' does not start: auth.jwt_keys "
                                    "'/nowhere/keys' cannot be read")));
  options.method = "service";
  options.plugin_options = {{"service", "http://127.0.0.1:1/check"}};
  const AuthSetup setup = make_authenticator(options, 0);
  ASSERT_THAT(setup.problems, testing::IsEmpty());
  EXPECT_EQ(setup.authenticator->threads(), 8U);
  const std::string token = "a-token-of-the-service";
  const Judgement unknown =
      setup.authenticator->judge({"service", Bytes(token.begin(), token.end()), "1.1.1.1:1"}, 1);
  EXPECT_FALSE(unknown.judged);
  EXPECT_THAT(unknown.reason, HasSubstr("service: "));
  EXPECT_TRUE(setup.authenticator->judge({"jwt", {}, ""}, 1).judged) << "of another method";
}

}  // namespace
}  // namespace connect_bridge
