// What is said, at both sides, of types that the exporter cannot take.
#include <gtest/gtest.h>

#include <algorithm>

#include "unit/side/action.hpp"
#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

const TypeLack kLack{"type_unknown", "the type p/msg/T is not known here: install the package p"};

Topic lacking(Topic topic, const std::string& type = kType) {
  topic.type = type;
  topic.lack = kLack;
  return topic;
}
ServiceState lacking(ServiceState service, const std::string& type = kServiceType) {
  service.type = type;
  service.lack = kLack;
  return service;
}
LackTold told(const std::string& name, const std::string& type) {
  return {InterfaceKind::kTopic, name, type, kLack.code, kLack.reason};
}

// What the status shows as lacking.
std::string lacking(const Script& s) {
  std::string all;
  const auto status = s.status();
  for (const auto& lack : status.links.at(0).lacking)
    all += (lack.exported ? "here " : "there ") + lack.what + ":" + lack.type + "\n";
  return all;
}

struct TypeLacksTest : testing::Test {
  Script s{server({acting()})};
};

TEST_F(TypeLacksTest, ATopicIsNotOfferedAndThePeerIsTold) {
  s.graph({lacking(topic("/a").pub(1)), lacking(topic("/b").pub(2)),
           typed(topic("/c").pub(3), "p/msg/Known")});
  s.login(1);
  s.did();
  s.said(1);
  s.logged.clear();
  s.say(1, Accepts{{{{"/**"}, {}, {"/**"}, {"/**"}, {"/**"}}}, {}});
  EXPECT_EQ(s.said(1), "offer lacks /a:p/msg/T type_unknown\noffer 1/c[1] complete\n");
  s.did();
  EXPECT_EQ(s.logged, "cannot export /a: " + kLack.reason + "\n");
}

TEST_F(TypeLacksTest, OneThatCanBeTakenNowIsOffered) {
  s.graph({lacking(topic("/a").pub(1))});
  s.join(1);
  s.said(1);
  s.graph({lacking(topic("/a").pub(1).pub(2))});
  EXPECT_EQ(s.said(1), "");
  s.graph({topic("/a").pub(1).pub(2)});
  EXPECT_EQ(s.said(1), "offer 1/a[1 2]\n");
}

TEST_F(TypeLacksTest, AServiceLikewise) {
  s.join(1);
  s.said(1);
  s.graph({}, {lacking(service("/s"))});
  EXPECT_EQ(s.said(1), "offer lacks /s:p/srv/S type_unknown\n");
  s.graph({}, {service("/s")});
  EXPECT_EQ(s.said(1), "offer 1/s[]\n");
}

TEST_F(TypeLacksTest, OfAnActionNoPartIsOffered) {
  s.join(1);
  s.said(1);
  s.logged.clear();
  serve_action(s, kLack);  // of the type of its goals
  EXPECT_EQ(s.said(1), "offer lacks /fib:p/action/Fib type_unknown\n");
  s.did();
  EXPECT_EQ(s.logged, "cannot export the action /fib: " + kLack.reason + "\n");
  EXPECT_EQ(lacking(s), "here the action /fib:p/action/Fib\n");
  serve_action(s);
  EXPECT_EQ(lacking(s), "");
  const std::string offer = s.said(1);
  EXPECT_EQ(std::count(offer.begin(), offer.end(), '/'), 5 * 3) << offer;
}

TEST_F(TypeLacksTest, OnlyWhatThePeerMayHaveAndAccepts) {
  Script strict(server({rule({"/a", "/b"}, {})}));
  strict.graph({lacking(topic("/a").pub(1), "p/msg/A"), lacking(topic("/b").pub(2), "p/msg/B"),
                lacking(topic("/c").pub(3), "p/msg/C"), lacking(topic("/b").sub(4), "p/msg/D")});
  strict.login(1);
  strict.said(1);
  strict.say(1, Accepts{{{{"/b", "/c"}, {}}}, {}});
  EXPECT_EQ(strict.said(1), "offer lacks /b:p/msg/B type_unknown\noffer complete\n");
  // A right that is new.
  strict.say(1, Accepts{{{{"/**"}, {}}}, {}});
  EXPECT_EQ(strict.said(1), "offer lacks /a:p/msg/A type_unknown\n");
}

TEST_F(TypeLacksTest, EachConnectionIsToldAgainAndTheLogIsNot) {
  s.graph({lacking(topic("/a").pub(1))});
  s.join(1);
  s.lose(1);
  s.did();
  s.logged.clear();
  s.login(2);
  s.say(2, Accepts{{{{"/**"}, {}}}, {}});
  EXPECT_NE(s.said(2).find("offer lacks /a:p/msg/T"), std::string::npos);
  s.did();
  EXPECT_EQ(s.logged.find("cannot export"), std::string::npos);
}

TEST_F(TypeLacksTest, TheLogNamesATypeOnceForAllPeers) {
  s.graph({lacking(topic("/a").pub(1)), lacking(topic("/b").pub(2))});
  s.join(1);
  s.login(2);
  s.did();
  s.logged.clear();
  s.said(2);
  s.say(2, Accepts{{{{"/b"}, {}}}, {}});
  EXPECT_EQ(s.said(2), "offer lacks /b:p/msg/T type_unknown\noffer complete\n");
  s.did();
  EXPECT_EQ(s.logged, "");
}

TEST_F(TypeLacksTest, NoMoreThanAPeerTakes) {
  std::vector<Topic> topics;
  for (std::size_t i = 0; i < kLacksMax + 10; ++i)
    topics.push_back(
        lacking(topic("/a" + std::to_string(i)).pub(1), "p/msg/T" + std::to_string(i)));
  s.graph(topics);
  s.login(1);
  s.say(1, Accepts{{{{"/**"}, {}}}, {}});
  const std::string line = s.said(1);
  EXPECT_EQ(std::count(line.begin(), line.end(), ':'), static_cast<int>(kLacksMax)) << line;
  s.did();
  EXPECT_NE(s.logged.find("cannot export /a" + std::to_string(kLacksMax + 9) + ":"),
            std::string::npos);
}

// To subscribe would fail: that was said.
TEST_F(TypeLacksTest, AListenerOfThePeerChangesNothing) {
  s.join(1);
  s.graph({lacking(topic("/a").pub(1))});
  s.did();
  s.say(1, Listeners{{{{1}, "/a", kType, "", "/far", qos()}}, {}});
  EXPECT_EQ(s.did(), "");
}

// ---- at the importer

TEST_F(TypeLacksTest, WhatAPeerLacksIsOneLineForEachType) {
  s.join(1);
  s.logged.clear();
  s.say(1, Offer{{}, true, {told("/a", kType), told("/b", kType)}});
  s.say(1, Offer{{}, false, {told("/c", kType)}});
  s.did();
  const std::string words = ", and says: " + kLack.reason + " (type_unknown)\n";
  EXPECT_EQ(s.logged, "/peer at 10.0.0.1 cannot export /a" + words);
  s.logged.clear();
  LackTold action = told("/fib", "p/action/Fib");
  action.kind = InterfaceKind::kAction;
  s.say(1, Offer{{}, false, {action}});
  s.did();
  EXPECT_EQ(s.logged, "/peer at 10.0.0.1 cannot export the action /fib" + words);
}

TEST_F(TypeLacksTest, TheStatusShowsItUntilItIsOffered) {
  s.join(1);
  s.say(1, Offer{{}, false, {told("/a", kType), told("/b", "p/msg/U")}});
  EXPECT_EQ(lacking(s), "there /a:" + std::string(kType) + "\nthere /b:p/msg/U\n");
  s.say(1, Offer{{channel(1, "/a", {origin(1, 9)})}, false});
  EXPECT_EQ(lacking(s), "there /b:p/msg/U\n");
  std::vector<LackTold> many;
  for (std::size_t i = 0; i < kLacksMax; ++i)
    many.push_back(told("/c", "p/msg/C" + std::to_string(i)));
  s.say(1, Offer{{}, false, many});
  EXPECT_EQ(s.status().links.at(0).lacking.size(), kLacksMax);
  s.lose(1);
  EXPECT_EQ(lacking(s), "");
}

TEST_F(TypeLacksTest, WhatIsNotImportedIsNotLogged) {
  Script strict(server({rule({}, {"/a"})}));
  strict.join(1);
  strict.logged.clear();
  LackTold other = told("/a", "p/msg/U");
  other.kind = InterfaceKind::kOther;
  strict.say(1, Offer{{}, true, {told("/b", kType), told("no name", "p/msg/V"), other}});
  strict.did();
  EXPECT_EQ(strict.logged, "");
  EXPECT_TRUE(strict.status().links.at(0).open);
}

}  // namespace
}  // namespace connect_bridge::side_test
