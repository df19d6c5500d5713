#include "core/policy/pattern.hpp"

#include <gtest/gtest.h>

#include <chrono>

namespace connect_bridge {
namespace {

Pattern pattern(std::string_view text) {
  auto result = Pattern::parse(text);
  if (!result) ADD_FAILURE() << result.error().message;
  return result.ok() ? std::move(result).value() : Pattern::parse("/failed").value();
}

bool matches(std::string_view text, std::string_view name) {
  const bool result = pattern(text).matches(name);
  EXPECT_EQ(pattern_matches(text, name), result);
  return result;
}

bool covers(std::string_view text, std::string_view name) {
  const bool result = pattern(text).covers(name);
  EXPECT_EQ(pattern_covers(text, name), result);
  return result;
}

TEST(Pattern, APlainNameIsItself) {
  EXPECT_TRUE(matches("/tf", "/tf"));
  EXPECT_FALSE(matches("/tf", "/tf_static"));
  EXPECT_FALSE(matches("/tf", "/robot/tf"));
  EXPECT_FALSE(matches("/tf", "/tf/more"));
  EXPECT_FALSE(matches("/tf", "/TF"));
}

TEST(Pattern, AStarStaysInItsToken) {
  EXPECT_TRUE(matches("/map_server/*", "/map_server/map"));
  EXPECT_FALSE(matches("/map_server/*", "/map_server"));
  EXPECT_FALSE(matches("/map_server/*", "/map_server/a/b"));
  EXPECT_TRUE(matches("/arm_*/state", "/arm_left/state"));
  EXPECT_TRUE(matches("/arm_*/state", "/arm_/state"));
  EXPECT_FALSE(matches("/arm_*/state", "/arm/state"));
  EXPECT_TRUE(matches("/*a*b*", "/xaxxbx"));
  EXPECT_TRUE(matches("/*ab", "/aab"));
  EXPECT_FALSE(matches("/*a*b*", "/xbxxax"));
  EXPECT_TRUE(matches("/a*a", "/aa"));
  EXPECT_FALSE(matches("/a*a", "/a"));
}

TEST(Pattern, TwoStarsAreAnyTokensAndAtLeastOneAtTheEnd) {
  EXPECT_TRUE(matches("/camera/**", "/camera/image"));
  EXPECT_TRUE(matches("/camera/**", "/camera/left/image"));
  EXPECT_FALSE(matches("/camera/**", "/camera"));
  EXPECT_FALSE(matches("/camera/**", "/camera_2/image"));
  EXPECT_TRUE(matches("/**", "/a"));
  EXPECT_TRUE(matches("/**", "/a/b/c"));
  EXPECT_TRUE(matches("/**/image", "/image"));
  EXPECT_TRUE(matches("/**/image", "/a/b/image"));
  EXPECT_FALSE(matches("/**/image", "/a/b/image/raw"));
  EXPECT_TRUE(matches("/a/**/b/**/c", "/a/b/c"));
  EXPECT_TRUE(matches("/a/**/b/**/c", "/a/x/b/b/y/c/c"));
  EXPECT_FALSE(matches("/a/**/b/**/c", "/a/c/b"));
  EXPECT_TRUE(matches("/**/**", "/a"));
  EXPECT_TRUE(matches("/**/x*/**", "/a/xb/c"));
  EXPECT_FALSE(matches("/**/x*/**", "/a/xb"));
}

TEST(Pattern, HiddenTokensMustBeSpelledOut) {
  EXPECT_FALSE(matches("/**", "/_hidden"));
  EXPECT_FALSE(matches("/**", "/a/_hidden"));
  EXPECT_FALSE(matches("/**", "/_hidden/a"));
  EXPECT_FALSE(matches("/*", "/_hidden"));
  EXPECT_FALSE(matches("/*hidden", "/_hidden"));
  EXPECT_FALSE(matches("/a/**/b", "/a/_h/b"));
  EXPECT_TRUE(matches("/_hidden", "/_hidden"));
  EXPECT_TRUE(matches("/_*", "/_hidden"));
  EXPECT_TRUE(matches("/a/**/_h/**", "/a/b/c/_h/d"));
  EXPECT_FALSE(matches("/a/**/_h/**", "/a/_x/c/_h/d"));
  EXPECT_FALSE(matches("/a/**/_h/**", "/a/b/_h/_d"));
  EXPECT_TRUE(matches("/**", "/a_/b_c"));  // not hidden
}

TEST(Pattern, WhatIsDeniedIsDeniedWithItsHiddenNames) {
  EXPECT_TRUE(covers("/camera/**", "/camera/_secret"));
  EXPECT_TRUE(covers("/camera/**", "/camera/_a/b"));
  EXPECT_TRUE(covers("/*/x", "/_a/x"));
  EXPECT_FALSE(covers("/camera/**", "/camera"));
  EXPECT_FALSE(covers("/camera/**", "/other/_x"));
}

TEST(Pattern, FaultyTextsAreRefusedWithWhatWasExpected) {
  const std::pair<std::string, std::string> cases[] = {
      {"", "starts with '/'"},
      {"tf", "starts with '/'"},
      {"*", "starts with '/'"},
      {"/", "no empty part"},
      {"/a/", "no empty part"},
      {"//a", "no empty part"},
      {"/a//b", "no empty part"},
      {"/a**", "whole part"},
      {"/**a", "whole part"},
      {"/***", "whole part"},
      {"/1a", "digit"},
      {"/a-b", "only letters"},
      {"/a b", "only letters"},
      {"/a?", "only letters"},
      {"/~a", "only letters"},
      {"/{a,b}", "only letters"},
      {"/\xC3\xA4", "only letters"},
      {std::string("/a\0b", 4), "only letters"},
      {"/" + std::string(255, 'a'), "at most 255"},
  };
  for (const auto& [text, expected] : cases) {
    const auto result = Pattern::parse(text);
    ASSERT_FALSE(result.ok()) << text;
    EXPECT_NE(result.error().message.find(expected), std::string::npos) << result.error().message;
    EXPECT_FALSE(pattern_matches(text, "/a"));
    EXPECT_FALSE(pattern_covers(text, "/a"));
  }
  EXPECT_TRUE(Pattern::parse("/" + std::string(254, 'a')).ok());
  EXPECT_TRUE(Pattern::parse("/*1").ok());
}

TEST(Pattern, HostilePatternsAreNotExponential) {
  std::string stars = "/";
  while (stars.size() < 250) stars += "*a";
  const std::string name = "/" + std::string(254, 'a');
  std::string tokens;
  while (tokens.size() < 248) tokens += "/**/a";
  std::string path;
  while (path.size() < 252) path += "/a";
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < 20; ++i) {
    EXPECT_FALSE(matches(stars + "b", name));
    EXPECT_FALSE(matches(tokens + "/b", path));
    EXPECT_TRUE(matches(stars, name));
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(2));
}

// The definition, word for word: slow, but with nothing to get wrong.
bool slowly(std::string_view p, std::string_view n, bool at_token) {
  if (p.empty()) return n.empty();
  if (at_token && p.substr(0, 2) == "**") {
    if (p.size() == 2) {
      if (n.empty()) return false;
      return n.front() != '_' && n.find("/_") == std::string_view::npos;
    }
    const auto rest = p.substr(3);
    while (true) {
      if (slowly(rest, n, true)) return true;
      const auto slash = n.find('/');
      if (n.empty() || n.front() == '_' || slash == std::string_view::npos) return false;
      n.remove_prefix(slash + 1);
    }
  }
  if (n.empty()) return p == "*" && !at_token;
  if (at_token && n.front() == '_' && p.front() != '_') return false;
  if (p.front() == '*') {
    if (slowly(p.substr(1), n, false)) return true;
    return n.front() != '/' && slowly(p, n.substr(1), false);
  }
  if (p.front() != n.front()) return false;
  return slowly(p.substr(1), n.substr(1), p.front() == '/');
}

TEST(Pattern, AgreesWithItsDefinition) {
  const std::string_view pattern_tokens[] = {"**", "*", "a", "_a", "_*", "a*", "*b"};
  const std::string_view name_tokens[] = {"a", "b", "_a", "ab"};
  std::vector<std::string> patterns = {""};
  std::vector<std::string> names = {""};
  for (std::size_t i = 0; i < patterns.size() && patterns.size() < 2800; ++i) {
    for (const auto token : pattern_tokens) {
      patterns.push_back(patterns[i] + "/" + std::string(token));
    }
  }
  for (std::size_t i = 0; i < names.size() && names.size() < 340; ++i) {
    for (const auto token : name_tokens) names.push_back(names[i] + "/" + std::string(token));
  }
  for (std::size_t i = 1; i < patterns.size(); ++i) {
    const auto parsed = pattern(patterns[i]);
    for (std::size_t k = 1; k < names.size(); ++k) {
      const auto expected = slowly(std::string_view(patterns[i]).substr(1),
                                   std::string_view(names[k]).substr(1), true);
      ASSERT_EQ(parsed.matches(names[k]), expected) << patterns[i] << " " << names[k];
    }
  }
}

TEST(Names, CanonicalNames) {
  for (const auto* name : {"/a", "/a/b_2", "/_hidden/x", "/A__b"}) {
    EXPECT_TRUE(is_canonical_name(name)) << name;
  }
  for (const auto* name : {"", "/", "a", "/a/", "//a", "/a//b", "/1", "/a/2b", "/a*", "/**", "/a-b",
                           "~/a", "/a b", "/a\n"}) {
    EXPECT_FALSE(is_canonical_name(name)) << name;
  }
  EXPECT_TRUE(is_canonical_name("/" + std::string(254, 'a')));
  EXPECT_FALSE(is_canonical_name("/" + std::string(255, 'a')));
}

TEST(Names, TypeNames) {
  for (const auto* type : {"std_msgs/msg/String", "a/srv/B2", "nav2_msgs/action/Wait_1"}) {
    EXPECT_TRUE(is_type_name(type)) << type;
  }
  for (const auto* type :
       {"", "std_msgs", "std_msgs/String", "a/msg/", "/msg/B", "a/idl/B", "a/msg/B/C", "1a/msg/B",
        "a/msg/2", "a-b/msg/C", "_a/msg/B", "a/msg/B ", "../msg/B"}) {
    EXPECT_FALSE(is_type_name(type)) << type;
  }
  EXPECT_FALSE(is_type_name("a/msg/" + std::string(250, 'B')));
}

}  // namespace
}  // namespace connect_bridge
