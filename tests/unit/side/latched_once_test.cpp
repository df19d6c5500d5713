// A latched sample over breaks: who was there gets it once, whoever comes gets it.
#include <gtest/gtest.h>

#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

// Link 1 has offered the latched /order of publisher 11, and subscriber 1 has got sample 500.
struct Ordered : Script {
  Ordered() : Script(keeping()) {
    graph({topic("/order").sub(1, latched())});
    pass(1000);
    session = join(1);
    say(1, Offer{{channel(1, "/order", {origin(1, 11, latched())})}, true});
    said(1);
    message(1, 1, 1, "go", 500);
    EXPECT_NE(did().find("publish 2 go\n"), std::string::npos);
  }
  // The link is back; what this side demands then.
  std::string come_back(std::uint32_t connection, std::uint32_t number) {
    EXPECT_EQ(join(connection, session), session);
    say(connection, Offer{{channel(number, "/order", {origin(3, 11, latched())})}, true});
    pass(1000);  // subscribers find a new mirror
    return said(connection);
  }
  Token128 session;
};

TEST(LatchedOnce, AShortBreakDoesNotBringItAgain) {
  Ordered s;
  s.lose(1);
  EXPECT_EQ(s.come_back(2, 5), "demand 5 on resume has 3:500\n");
  s.message(2, 5, 3, "go", 500);  // a peer that sends it all the same
  EXPECT_EQ(s.did(), "");
  s.message(2, 5, 3, "stop", 600);
  EXPECT_EQ(s.did(), "publish 2 stop\n");
  s.lose(2);
  EXPECT_EQ(s.come_back(3, 6), "demand 6 on resume has 3:600\n");
}

TEST(LatchedOnce, ThoseWhoWereThereGetItOnceOverALongBreak) {
  Ordered s;
  s.lose(1);
  s.pass(10'000);
  EXPECT_EQ(s.did(), "unmirror 2\nclaim []\n");
  EXPECT_EQ(s.come_back(2, 5), "demand 5 on resume has 3:500\n");
  s.message(2, 5, 3, "go", 500);
  EXPECT_EQ(s.did(), "mirror 3 /order reliable latched 1\nclaim [11]\n");
}

// The mirror that was made again holds no sample for a new subscriber, so another one is made.
TEST(LatchedOnce, WhoComesAfterALongBreakGetsIt) {
  Ordered s;
  s.lose(1);
  s.pass(10'000);
  s.come_back(2, 5);
  s.did();
  s.graph({topic("/order").sub(1, latched()).sub(2, latched())});
  s.pass(1000);
  EXPECT_EQ(s.said(2), "demand 5 off\ndemand 5 on resume\n");
  s.message(2, 5, 3, "go", 500);
  EXPECT_EQ(s.did(), "unmirror 3\nmirror 4 /order reliable latched 1\nclaim [11]\npublish 4 go\n");
}

TEST(LatchedOnce, AfterTheTimeForAReturnNothingIsRemembered) {
  Ordered s;
  s.lose(1);
  s.pass(61'000);
  s.join(2);
  s.say(2, Offer{{channel(5, "/order", {origin(3, 11, latched())})}, true});
  s.pass(1000);
  EXPECT_EQ(s.said(2), "demand 5 on resume\n");
}

TEST(LatchedOnce, TheExporterSendsWhatIsNewToTheImporter) {
  for (const std::uint64_t has : {4, 5}) {
    Script s(server());
    s.graph({topic("/map").pub(7, latched())});
    s.pass(1000);
    s.join(1);
    s.join(2);
    s.demand(2, 1);  // another peer, for whom the topic stays subscribed
    s.did();
    s.take(2, 7, "map", -1, 5);
    const HeldSamples held{{1}, has};
    s.say(1, Demand{{{.channel = {1}, .number = 2, .has = {held}}}});
    EXPECT_EQ(s.said(1), has == 4 ? "1.1 map\n" : "") << has;
    s.take(2, 7, "next", -1, 6);
    EXPECT_EQ(s.said(1), "1.1 next\n") << has;
  }
}

// Publishers that lack numbers: every sample may be a new one.
TEST(LatchedOnce, SamplesWithoutANumberAlwaysCome) {
  Script s(server());
  s.graph({topic("/map").pub(7, latched())});
  s.pass(1000);
  s.join(1);
  s.say(1, Demand{{{.channel = {1}, .number = 1, .has = {{{1}, 9}}}}});
  s.did();
  s.take(2, 7, "map", -1, 0);
  EXPECT_EQ(s.said(1), "1.1 map\n");
}

}  // namespace
}  // namespace connect_bridge::side_test
