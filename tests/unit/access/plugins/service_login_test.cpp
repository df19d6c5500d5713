#include "access/plugins/service_login.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr Stamp kServiceNow = 1'800'000'000 * kStampSecond;
constexpr char kServiceToken[] = "a-token-of-the-service";

struct World {
  HttpAnswer answer;
  std::vector<HttpRequest> asked;

  Judgement judge(const std::string& credential = kServiceToken) {
    ServiceLogin login({true, "login.example", 443, "/check"}, [this](const HttpRequest& request) {
      asked.push_back(request);
      return answer;
    });
    return login.judge({"", {credential.begin(), credential.end()}, "192.0.2.7:5123"}, kServiceNow);
  }
};

TEST(ServiceLogin, AsksWithTheCredentialAndTakesTheIdentity) {
  World world;
  world.answer = {
      200, R"({"identity":"anna","groups":["ops","see"],"expires":1800000060})", {}, {}};
  const Judgement judged = world.judge();
  ASSERT_TRUE(judged.identity) << judged.reason;
  EXPECT_EQ(judged.identity->name, "anna");
  EXPECT_THAT(judged.identity->groups, ElementsAre("ops", "see"));
  EXPECT_EQ(judged.identity->expires, kServiceNow + 60 * kStampSecond);
  ASSERT_EQ(world.asked.size(), 1U);
  EXPECT_EQ(world.asked[0].url.target, "/check");
  EXPECT_EQ(world.asked[0].json,
            R"({"credential":"a-token-of-the-service","peer":"192.0.2.7:5123"})");
}

TEST(ServiceLogin, EverythingElseIsRefused) {
  const std::vector<std::pair<HttpAnswer, const char*>> wrong{
      {{401, {}, {}, {}}, "refused"},
      {{403, R"({"identity":"anna"})", {}, {}}, "refused"},
      {{500, R"({"identity":"anna"})", {}, {}}, "answers 500"},
      {{302, R"({"identity":"anna"})", {}, {}}, "answers 302"},
      {{0, {}, {}, "no answer in time"}, "no answer in time"},
      {{200, "", {}, {}}, "not a JSON object"},
      {{200, "[]", {}, {}}, "not a JSON object"},
      {{200, "{}", {}, {}}, "no \"identity\""},
      {{200, R"({"identity":7})", {}, {}}, "no \"identity\""},
      {{200, R"({"identity":""})", {}, {}}, "not a name"},
      {{200, R"({"identity":"a\nb"})", {}, {}}, "not a name"},
      {{200, R"({"identity":"a","groups":"ops"})", {}, {}}, "not a list"},
      {{200, R"({"identity":"a","groups":[1]})", {}, {}}, "not names"},
      {{200, R"({"identity":"a","expires":"soon"})", {}, {}}, "not a time"},
      {{200, R"({"identity":"a","expires":1e300})", {}, {}}, "not a time"},
      {{200, R"({"identity":"a","expires":1799999999})", {}, {}}, "has expired"}};
  for (const auto& [answer, word] : wrong) {
    World world;
    world.answer = answer;
    const Judgement judged = world.judge();
    EXPECT_FALSE(judged.identity) << word;
    EXPECT_THAT(judged.reason, HasSubstr(word));
  }
}

TEST(ServiceLogin, AnIdentityHasSoManyGroupsAtTheMost) {
  for (const std::size_t count : {256U, 257U}) {
    World world;
    std::string groups = "\"ops\"";
    for (std::size_t i = 1; i < count; ++i) groups += ",\"ops\"";
    world.answer = {200, R"({"identity":"anna","groups":[)" + groups + "]}", {}, {}};
    EXPECT_EQ(world.judge().identity.has_value(), count == 256) << count;
  }
}

// What the service could not say counts against nobody.
TEST(ServiceLogin, WhatItDoesNotAnswerIsNoWrongLogin) {
  const auto judged = [](const HttpAnswer& answer) {
    World world;
    world.answer = answer;
    return world.judge().judged;
  };
  EXPECT_FALSE(judged({0, {}, {}, "no answer in time"}));
  for (const int status : {302, 404, 408, 425, 429, 500, 502, 503, 504})
    EXPECT_FALSE(judged({status, {}, {}, {}})) << status;
  EXPECT_FALSE(judged({200, "<html>", {}, {}}));
  EXPECT_FALSE(judged({200, R"({"identity":7})", {}, {}}));
  EXPECT_TRUE(judged({200, R"({"identity":"a","expires":1799999999})", {}, {}}));
  EXPECT_TRUE(judged({200, R"({"identity":"anna"})", {}, {}}));
  for (const int status : {400, 401, 403, 413, 415, 422, 431})
    EXPECT_TRUE(judged({status, {}, {}, {}})) << status;
  EXPECT_TRUE(World().judge("short").judged);
}

TEST(ServiceLogin, IsNotAskedAboutWhatIsNoToken) {
  World world;
  for (const char* credential : {"", "short", "with a blank in it, and long"})
    EXPECT_FALSE(world.judge(credential).identity);
  EXPECT_TRUE(world.asked.empty());
}

}  // namespace
}  // namespace connect_bridge
