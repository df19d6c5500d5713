// The end of a link that has told much takes several steps, and leaves what it leaves in one.
#include <gtest/gtest.h>

#include <cstddef>
#include <sstream>
#include <string>

#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

SideOptions ending(SideOptions options, std::size_t entries) {
  options.ends_at_once = entries;
  return options;
}

// Link 1 demands /a and /b of publishers 1 and 2, offers /c and /d, and offers the service /s.
struct MuchTold : Script {
  explicit MuchTold(SideOptions options) : Script(std::move(options)) {
    graph({topic("/a").pub(1), topic("/b").pub(2), topic("/c").sub(3), topic("/d").sub(4)});
    pass(3000);
    session = join(1);
    say(1, Demand{{{.channel = {1}, .number = 1, .resume = true},
                   {.channel = {2}, .number = 1, .resume = true}}});
    say(1, Offer{{channel(1, "/c", {origin(1, 11)}), channel(2, "/d", {origin(1, 12)})}, true});
    said(1);
    did();
  }
  // Steps until nothing of this moment is left to be done.
  std::size_t settle() {
    std::size_t steps = 0;
    const auto due = [&] {
      const auto next = side.next_deadline();
      return next && *next <= flow_test::now_ms(at).steady;
    };
    for (; due() && steps < 100; ++steps) give(TimePassed{});
    return steps;
  }
  Token128 session;
};

// Each step may tell other bridges what is left.
std::string without_claims(const std::string& lines) {
  std::string others, line;
  for (std::istringstream all(lines); std::getline(all, line);)
    if (!line.starts_with("claim")) others += line + "\n";
  return others;
}

TEST(LinkEnd, WhatIsDoneIsTheSameInOneStepAndInMany) {
  const auto done = [](std::size_t entries) {
    MuchTold s(ending(server(), entries));
    s.lose(1);
    s.pass(3000);
    s.settle();
    s.pass(1000);
    return without_claims(s.did());
  };
  const std::string all = done(512);
  EXPECT_NE(all.find("unsubscribe 2\nunsubscribe 3\n"), std::string::npos) << all;
  EXPECT_NE(all.find("unmirror"), std::string::npos) << all;
  EXPECT_EQ(done(1), all);
  EXPECT_EQ(done(3), all);
}

TEST(LinkEnd, AStepEndsSoManyEntries) {
  MuchTold s(ending(server(), 1));
  s.lose(1);
  EXPECT_EQ(s.did(), "unsubscribe 2\n");
  s.give(TimePassed{});
  EXPECT_EQ(s.did(), "unsubscribe 3\n");
  EXPECT_EQ(s.settle(), 2U);
  s.pass(2999);
  EXPECT_EQ(s.did(), "");
  MuchTold whole(ending(server(), 512));
  whole.lose(1);
  EXPECT_EQ(whole.did(), "unsubscribe 2\nunsubscribe 3\n");
}

TEST(LinkEnd, WhatIsServedForItsPeerIsCountedToo) {
  MuchTold s(ending(server({callable()}), 1));
  s.graph({topic("/a").pub(1), topic("/b").pub(2)}, {service("/r"), service("/s"), service("/t")});
  s.lose(1);
  EXPECT_EQ(s.settle(), 6U);
}

// What nodes publish before a topic's turn is kept as what they publish after it.
TEST(LinkEnd, NothingIsMissingThatCameMeanwhile) {
  MuchTold s(ending(keeping(), 1));
  s.lose(1);
  s.take(2, 1, "a");
  s.take(3, 2, "b");
  s.settle();
  s.take(3, 2, "c");
  EXPECT_EQ(s.join(2, s.session), s.session);
  s.say(2, Demand{{{.channel = {4}, .number = 1, .resume = true, .after = 0}}});
  std::string lines;
  for (int i = 0; i < 100; ++i, s.pass(1)) lines += s.said(2);
  EXPECT_NE(lines.find("4.1 b\n4.1 c\n"), std::string::npos) << lines;
}

// 64 of them are handed over in the time of another entry.
TEST(LinkEnd, MessagesThatAreKeptCountAsWell) {
  const auto steps = [](int unread) {
    MuchTold s(ending(keeping(), 2));
    for (int n = 0; n < unread; ++n) {
      s.take(2, 1, "unread");
      s.said(1);
    }
    s.lose(1);
    return s.settle();
  };
  EXPECT_EQ(steps(2 * 64), steps(1) + 1);
}

TEST(LinkEnd, NothingOfThePeerPassesAfterTheFirstStep) {
  MuchTold s(ending(server(), 1));
  s.message(1, 1, 1, "before");
  EXPECT_EQ(s.did(), "publish 2 before\n");
  s.lose(1);
  s.did();
  s.message(1, 1, 1, "after");
  s.settle();
  EXPECT_EQ(s.did().find("publish"), std::string::npos);
}

TEST(LinkEnd, ALinkThatIsBackMeanwhileGoesOnAsAfterAnyBreak) {
  MuchTold s(ending(server(), 1));
  s.lose(1);
  s.did();
  EXPECT_EQ(s.join(2, s.session), s.session);
  s.did();
  s.say(2, Offer{{channel(1, "/c", {origin(1, 11)}), channel(2, "/d", {origin(1, 12)})}, true});
  EXPECT_EQ(s.said(2), "demand 1 2 on\n");
  s.message(2, 2, 1, "again");
  EXPECT_EQ(s.did(), "publish 3 again\n");
}

// Link 2 has the topic demanded for a publisher of its own: what it brings of another one is no
// duplicate once that one's link is lost.
TEST(LinkEnd, ALostFeederGivesWayBeforeItsTurn) {
  MuchTold s(ending(server(), 1));
  s.join(2);
  s.say(2, Offer{{channel(1, "/c", {origin(1, 11), origin(2, 13)})}, true});
  EXPECT_EQ(s.said(2), "demand 1 on\n");
  s.did();
  s.message(2, 1, 1, "of two", 10);
  EXPECT_EQ(s.did(), "");
  s.lose(1);
  s.did();
  s.message(2, 1, 1, "at once", 20);
  EXPECT_EQ(s.did(), "publish 2 at once\n");
}

TEST(LinkEnd, RulesThatChangeMeanwhileHoldForAllOfIt) {
  MuchTold s(ending(keeping(), 1));
  s.lose(1);
  s.take(3, 2, "b");
  s.did();
  s.give(PolicyChanged{Policy({rule({"/a"}, {"/c"})})});
  EXPECT_EQ(s.did(), "unsubscribe 3\n");
  s.pass(300);
  EXPECT_NE(s.did().find("unmirror 3\n"), std::string::npos);
}

}  // namespace
}  // namespace connect_bridge::side_test
