#include "core/policy/peer_accepts.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

namespace connect_bridge {
namespace {

Interface topic_of(const std::string& name, const std::string& type = "p/msg/T") {
  return {InterfaceKind::kTopic, name, type};
}

TEST(PeerAccepts, ANameIsTakenByARuleOfItsType) {
  const PeerAccepts accepts({{{{"/a", "/b", "/x/*"}, {"p/msg/A", "p/msg/B"}},
                              {{"/b", "/x/c"}, {"p/msg/C"}},
                              {{"/c"}, {}}},
                             {}});
  EXPECT_TRUE(accepts.takes(topic_of("/a", "p/msg/A")));
  EXPECT_TRUE(accepts.takes(topic_of("/b", "p/msg/B")));
  EXPECT_TRUE(accepts.takes(topic_of("/b", "p/msg/C")));
  EXPECT_TRUE(accepts.takes(topic_of("/x/c", "p/msg/A")));
  EXPECT_TRUE(accepts.takes(topic_of("/x/c", "p/msg/C")));
  EXPECT_TRUE(accepts.takes(topic_of("/c", "p/msg/D")));
  EXPECT_FALSE(accepts.takes(topic_of("/a", "p/msg/C")));
  EXPECT_FALSE(accepts.takes(topic_of("/x/d", "p/msg/C")));
  EXPECT_FALSE(accepts.takes(topic_of("/b", "p/msg/D")));
  EXPECT_FALSE(accepts.takes(topic_of("/d", "p/msg/A")));
}

TEST(PeerAccepts, ADenyWinsOverAllRulesAndWithItsHiddenNames) {
  const PeerAccepts accepts({{{{"/**", "/_h/**"}, {}}}, {"/camera/**", "/map", "/_h/*"}});
  EXPECT_TRUE(accepts.takes(topic_of("/camera")));
  EXPECT_TRUE(accepts.takes(topic_of("/_h/a/b")));
  for (const auto* name : {"/camera/image", "/camera/_x", "/map", "/_h/a", "/_other"})
    EXPECT_FALSE(accepts.takes(topic_of(name))) << name;
}

TEST(PeerAccepts, KindsAreApart) {
  const PeerAccepts accepts({{{{"/t"}, {}, {"/s"}, {"/a"}, {"/n"}}}, {}});
  EXPECT_TRUE(accepts.takes_parameters());
  EXPECT_TRUE(accepts.takes({InterfaceKind::kService, "/s", "p/srv/S"}));
  EXPECT_FALSE(accepts.takes({InterfaceKind::kService, "/t", "p/srv/S"}));
  EXPECT_FALSE(accepts.takes(topic_of("/s")));
  EXPECT_FALSE(PeerAccepts({{{{"/t"}, {}}}, {}}).takes_parameters());
}

// The worst lists that a peer may tell, and names that are made for them: no prefix leaves a
// pattern out early, each is read to its end, and the lists of literal names are as long as may be.
TEST(PeerAccepts, TheWorstListsTakeNothingThatOnlyNearlyMatches) {
  const auto filled = [](const std::string& pattern) {
    Accepts worst{{{{"/none"}, {}}}, {}};
    std::vector<std::string>& topics = worst.rules[0].topics;
    while (topics.size() < kWildcardsMax &&
           size_of(worst).wildcard_bytes + pattern.size() - 1 <= kWildcardBytesMax)
      topics.push_back(pattern);
    while (size_of(worst).entries < kAcceptEntriesMax)
      worst.deny.push_back("/n" + std::string(100, 'n'));
    return worst;
  };
  const std::string path = [] {
    std::string text;
    while (text.size() < 254) text += "/a";
    return text;
  }();
  const std::pair<std::string, std::string> cases[] = {
      {"/**/*a*a*a*a*b", path.substr(0, 40)},
      {"/**/*a*a*a*a*b", path},
      {"/*a*a*a*a*a*a*a*b", "/" + std::string(254, 'a')},
      {"/**/a" + std::string(246, 'a') + "b", "/" + std::string(254, 'a')},
  };
  for (const auto& [pattern, name] : cases) {
    const PeerAccepts accepts(filled(pattern));
    EXPECT_FALSE(accepts.takes(topic_of(name))) << pattern;
  }
}

}  // namespace
}  // namespace connect_bridge
