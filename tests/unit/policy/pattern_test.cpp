#include "core/policy/pattern.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace connect_bridge {
namespace {

Pattern pattern(std::string_view text) {
  auto result = Pattern::parse(text);
  if (!result) ADD_FAILURE() << result.error().message;
  return result.ok() ? std::move(result).value() : Pattern::parse("/failed").value();
}

bool matches(std::string_view text, std::string_view name) {
  return pattern(text).matches(name);
}

bool covers(std::string_view text, std::string_view name) {
  return pattern(text).covers(name);
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
    EXPECT_FALSE(is_pattern(text));
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

// A peer chooses the name as well, when it tells its listeners. What goes back to its stars needs
// thirty times as long for these.
TEST(Pattern, HostilePatternsAreReadOnce) {
  const auto repeated = [](const std::string& token, int count) {
    std::string text;
    for (int i = 0; i < count; ++i) text += token;
    return text;
  };
  const std::string name = "/" + std::string(254, 'a');
  const std::string path = repeated("/a", 127);
  const std::pair<std::string, std::string> pairs[] = {
      {"/*" + std::string(126, 'a') + "b", name},
      {"/*" + std::string(60, 'a') + "b" + std::string(60, 'a') + "*", name},
      {"/**" + repeated("/a", 60) + "/b/**", path},
      {"/**" + repeated("/a*", 60) + "/b*/**", path},
  };
  int matching = 0;
  for (int i = 0; i < 25'000; ++i)
    for (const auto& [text, of] : pairs) matching += int(matches(text, of));
  EXPECT_EQ(matching, 0);
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

// Of few letters, so that much is alike; and long ones, since 64 characters are read at a time.
class AlikeTexts {
 public:
  std::string pattern(unsigned letters_max) {
    std::string text;
    for (auto tokens = 1 + below(5); tokens > 0; --tokens)
      text += "/" + (below(5) == 0 ? "**" : letters("aaaab_*", 1 + below(letters_max)));
    return text;
  }
  // One that it matches, or does but for a character.
  std::string name_for(const std::string& pattern) {
    std::string name;
    for (std::size_t i = 0; i < pattern.size(); ++i) {
      if (pattern[i] != '*') {
        name += pattern[i];
      } else if (pattern.compare(i, 2, "**") != 0) {
        name += letters("aab", below(4));
      } else {
        name += letters("aab_", 1 + below(3));
        if (below(2) == 0) name += "/" + letters("aab_", 1 + below(3));
        ++i;
      }
    }
    if (below(2) == 0) name[below(static_cast<unsigned>(name.size()))] = 'b';
    return name;
  }

 private:
  unsigned below(unsigned n) { return static_cast<unsigned>(random_() % n); }
  std::string letters(const std::string& of, unsigned count) {
    std::string text;
    while (text.size() < count) text += of[below(static_cast<unsigned>(of.size()))];
    return text;
  }
  std::mt19937 random_{1};
};

TEST(Pattern, AgreesWithItsDefinitionOfTextsThatAreAlike) {
  // The definition takes a time that grows with their power.
  constexpr std::ptrdiff_t kStarsMax = 5;
  AlikeTexts texts;
  int compared = 0;
  int matching = 0;
  for (int i = 0; i < 60'000; ++i) {
    std::string text = texts.pattern(i % 10 == 0 ? 60 : 4);
    std::string name = texts.name_for(text);
    if (!Pattern::parse(text) || !is_canonical_name(name)) continue;
    if (std::count(text.begin(), text.end(), '*') > kStarsMax) continue;
    const auto expected = [&] {
      return slowly(std::string_view(text).substr(1), std::string_view(name).substr(1), true);
    };
    const bool both = expected();
    ASSERT_EQ(matches(text, name), both) << text << " " << name;
    const bool covered = covers(text, name);
    for (auto* shown : {&text, &name}) std::replace(shown->begin(), shown->end(), '_', 'c');
    ASSERT_EQ(covered, expected()) << text << " " << name;
    ++compared;
    matching += int(both);
  }
  EXPECT_GT(matching, compared / 5);
  EXPECT_GT(compared - matching, compared / 5);
}

// Many at a time are what each of them is.
TEST(PatternSet, MatchesAsItsMembersDo) {
  AlikeTexts texts;
  int matching = 0;
  for (int i = 0; i < 1000; ++i) {
    std::vector<std::string> patterns, names;
    std::size_t bytes = 0;
    while (patterns.size() < 40) {
      std::string text = texts.pattern(i % 10 == 0 ? 30 : 4);
      if (!is_pattern(text) || !has_wildcard(text)) continue;
      bytes += text.size() - text.find('*');
      if (bytes > kWildcardBytesMax) break;
      names.push_back(texts.name_for(text));
      patterns.push_back(std::move(text));
    }
    const PatternSet all({patterns.begin(), patterns.end()});
    std::vector<Pattern> members;
    for (const auto& text : patterns) members.push_back(pattern(text));
    for (const auto& name : names) {
      if (!is_canonical_name(name)) continue;
      const auto allowed = all.matching(name, Hidden::kSpelledOut);
      const auto denied = all.matching(name, Hidden::kAny);
      for (std::size_t k = 0; k < members.size(); ++k) {
        ASSERT_EQ(allowed[k], members[k].matches(name)) << patterns[k] << " " << name;
        ASSERT_EQ(denied[k], members[k].covers(name)) << patterns[k] << " " << name;
      }
      matching += static_cast<int>(allowed.count());
    }
  }
  EXPECT_GT(matching, 10'000);
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
