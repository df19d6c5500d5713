// What a side says of types that it cannot take, and so does not offer.
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
std::string line(const std::string& what) {
  return "cannot export " + what + ": " + kLack.reason + "\n";
}

struct TypeLacksTest : testing::Test {
  Script s{server({acting()})};
  // The lines of the log since the last call.
  std::string logged(Script& script) {
    script.did();
    return std::exchange(script.logged, {});
  }
};

TEST_F(TypeLacksTest, ATopicIsNotOfferedAndTheLogSaysItOnceForItsType) {
  s.graph({lacking(topic("/a").pub(1)), lacking(topic("/b").pub(2)),
           typed(topic("/c").pub(3), "p/msg/Known")});
  s.login(1);
  s.said(1);
  logged(s);
  s.say(1, Accepts{{{{"/**"}, {}, {"/**"}, {"/**"}, {"/**"}}}, {}});
  EXPECT_EQ(s.said(1), "offer 1/c[1] complete\n");
  EXPECT_EQ(logged(s), line("/a"));
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
  logged(s);
  s.graph({}, {lacking(service("/s"))});
  EXPECT_EQ(s.said(1), "");
  EXPECT_EQ(logged(s), line("/s"));
  s.graph({}, {service("/s")});
  EXPECT_EQ(s.said(1), "offer 1/s[]\n");
}

TEST_F(TypeLacksTest, OfAnActionNoPartIsOffered) {
  s.join(1);
  s.said(1);
  logged(s);
  serve_action(s, kLack);  // of the type of its goals
  EXPECT_EQ(s.said(1), "");
  EXPECT_EQ(logged(s), line("the action /fib"));
  serve_action(s);
  const std::string offer = s.said(1);
  EXPECT_EQ(std::count(offer.begin(), offer.end(), '/'), 5 * 3) << offer;
}

TEST_F(TypeLacksTest, OnlyWhatThePeerMayHaveAndAccepts) {
  Script strict(server({rule({"/a", "/b"}, {})}));
  strict.graph({lacking(topic("/a").pub(1), "p/msg/A"), lacking(topic("/b").pub(2), "p/msg/B"),
                lacking(topic("/c").pub(3), "p/msg/C"), lacking(topic("/b").sub(4), "p/msg/D")});
  strict.login(1);
  logged(strict);
  strict.say(1, Accepts{{{{"/b", "/c"}, {}}}, {}});
  EXPECT_EQ(logged(strict), line("/b"));
  // A right that is new.
  strict.say(1, Accepts{{{{"/**"}, {}}}, {}});
  EXPECT_EQ(logged(strict), line("/a"));
}

TEST_F(TypeLacksTest, ATypeIsOneLineForAllPeersAndConnections) {
  s.graph({lacking(topic("/a").pub(1)), lacking(topic("/b").pub(2))});
  s.join(1);
  s.login(2);
  logged(s);
  s.say(2, Accepts{{{{"/b"}, {}}}, {}});
  EXPECT_EQ(logged(s), "");
  s.lose(1);
  s.login(3);
  logged(s);
  s.say(3, Accepts{{{{"/**"}, {}}}, {}});
  EXPECT_EQ(logged(s), "");
}

// To subscribe would fail: that was said.
TEST_F(TypeLacksTest, AListenerOfThePeerChangesNothing) {
  s.join(1);
  s.graph({lacking(topic("/a").pub(1))});
  s.did();
  s.say(1, Listeners{{{{1}, "/a", kType, ""}}, {}});
  EXPECT_EQ(s.did(), "");
}

}  // namespace
}  // namespace connect_bridge::side_test
