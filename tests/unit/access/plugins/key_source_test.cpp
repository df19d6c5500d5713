#include "access/plugins/key_source.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <deque>
#include <fstream>

#include "unit/scratch.hpp"

namespace connect_bridge {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr char kOctSet[] =
    R"({"keys":[{"kty":"oct","kid":"h","k":"AyM1SysPpbyDfgZld3umj1qzKObwVMkoqQ-EstJQLr_T"}]})";
constexpr char kEdSet[] = R"({"keys":[{"kty":"OKP","crv":"Ed25519","kid":"d",)"
                          R"("x":"11qYAYKxCrfVS_7TyWQHOg7hcvPapiMlrwIaaPcHURo"}]})";

// What an address answers, in turn; the last one for ever.
class Answers {
 public:
  explicit Answers(std::deque<HttpAnswer> answers) : answers_(std::move(answers)) {}

  HttpFetch fetch() {
    return [this](const HttpRequest& request) {
      const std::lock_guard lock(mutex_);
      asked_.push_back(request.url.text("http"));
      HttpAnswer answer = answers_.front();
      if (answers_.size() > 1) answers_.pop_front();
      return answer;
    };
  }
  std::size_t asked() {
    const std::lock_guard lock(mutex_);
    return asked_.size();
  }

 private:
  std::mutex mutex_;
  std::deque<HttpAnswer> answers_;
  std::vector<std::string> asked_;
};

Url address() {
  return {true, "issuer.example", 443, "/keys?secret=x"};
}

TEST(KeyAddress, TheKeysAreThereAtTheFirstLogin) {
  Answers answers({{200, kEdSet, {}, {}}});
  KeyAddress source(address(), answers.fetch());
  std::vector<std::string> problems;
  const auto keys = source.changed(problems);
  ASSERT_TRUE(keys);
  EXPECT_EQ(keys->size(), 1U);
  EXPECT_THAT(problems, IsEmpty());
  EXPECT_FALSE(source.changed(problems));
  EXPECT_EQ(source.name(), "auth.jwt_keys https://issuer.example/keys");
}

TEST(KeyAddress, AnUnknownKeyAsksAgainButNotAtOnce) {
  Answers answers({{200, kEdSet, {}, {}}});
  KeyAddress source(address(), answers.fetch());
  for (int i = 0; i < 100; ++i) source.wanted();
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_EQ(answers.asked(), 1U);  // the next one a minute later

  Answers others({{200, kEdSet, {}, {}}});
  KeyAddress quick(address(), others.fetch(), std::chrono::milliseconds(10));
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_EQ(others.asked(), 1U);  // nobody wants more
  quick.wanted();
  for (int i = 0; i < 1000 && others.asked() < 2; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_EQ(others.asked(), 2U);
}

// However short it says that its keys are good for.
TEST(KeyAddress, IsAskedOnceAMinuteAtTheMost) {
  Answers answers({{200, kEdSet, std::chrono::seconds(0), {}}});
  const KeyAddress source(address(), answers.fetch());
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_EQ(answers.asked(), 1U);
}

TEST(KeyAddress, WhatIsWrongIsToldAndGivesNoKeys) {
  const std::vector<std::pair<HttpAnswer, const char*>> wrong{
      {{0, {}, {}, "no answer in time"}, "no answer in time"},
      {{503, kEdSet, {}, {}}, "answers 503"},
      {{200, "", {}, {}}, "issuer.example"},
      {{200, "<html>", {}, {}}, "issuer.example"},
      {{200, R"({"keys":[]})", {}, {}}, "issuer.example"},
      {{200, kOctSet, {}, {}}, "a secret key"}};
  for (const auto& [answer, word] : wrong) {
    Answers answers({answer});
    KeyAddress source(address(), answers.fetch());
    std::vector<std::string> problems;
    EXPECT_FALSE(source.changed(problems)) << word;
    EXPECT_THAT(problems, ElementsAre(HasSubstr(word)));
    problems.clear();
    EXPECT_FALSE(source.changed(problems));
    EXPECT_THAT(problems, IsEmpty());  // reported once
  }
}

TEST(KeyAddress, ItsEndDoesNotWaitForTheNextRequest) {
  Answers answers({{200, kEdSet, std::chrono::seconds(86400), {}}});
  const auto begin = std::chrono::steady_clock::now();
  { const KeyAddress source(address(), answers.fetch()); }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(30));
}

TEST(KeyFile, RefusesASecretThatEverybodyMayRead) {
  const std::string file = test::scratch_folder() + "open_keys.json";
  for (const auto& [text, wrong] : {std::pair{kOctSet, 1U}, std::pair{kEdSet, 0U}}) {
    std::ofstream{file} << text;
    ::chmod(file.c_str(), 0644);
    std::vector<std::string> problems;
    EXPECT_EQ(KeyFile(file).changed(problems).has_value(), wrong == 0);
    EXPECT_EQ(problems.size(), wrong);
  }
}

TEST(KeyFile, RefusesWhatEverybodyMayChange) {
  const std::string file = test::scratch_folder() + "wide_open_keys.json";
  std::ofstream{file} << kEdSet;
  ::chmod(file.c_str(), 0602);
  std::vector<std::string> problems;
  EXPECT_FALSE(KeyFile(file).changed(problems));
  EXPECT_THAT(problems, ElementsAre(HasSubstr("every user of this machine may change")));
}

}  // namespace
}  // namespace connect_bridge
