#include "core/link/appearing.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

namespace connect_bridge::test {
namespace {

using namespace std::chrono_literals;

struct AppearScene {
  // One that appears when its turn comes, unless it is not wanted any more.
  struct One final : Appearing::Waiting {
    One(AppearScene& of, Appearing::Line& its, std::string called)
        : scene(of), line(&its), name(std::move(called)) {}
    Appearing::Answer ask() {
      const auto answer = line->ask(*this, scene.now.steady);
      if (answer == Appearing::Answer::kNow) scene.made.push_back(name);
      return answer;
    }
    void appear(const Now&) override {
      if (wanted) ask();
    }

    AppearScene& scene;
    Appearing::Line* line;
    std::string name;
    bool wanted = true;
  };

  Now now{TimePoint{} + 1000s, 0, 0};
  Appearing all{2, 500us};
  LoopTurns packets{500ms};
  std::vector<std::string> made;

  Appearing::Line line(const Payer& payer, int at_once = 512) {
    return Appearing::Line(&all, payer, at_once, 5ms);
  }
  // What is due within this time happens.
  void pass(Duration time) {
    const TimePoint end = now.steady + time;
    while (all.deadline().value_or(TimePoint::max()) <= end) {
      now.steady = std::max(now.steady, *all.deadline());
      all.on_time(packets, now);
    }
    now.steady = end;
  }
};

Payer a_payer() {
  return std::make_shared<LoopTime>();
}

using Names = std::vector<std::string>;
using enum Appearing::Answer;

TEST(Appearing, AFewAtOnceThenOneByOneWhoeverAsks) {
  AppearScene s;
  auto one = s.line(a_payer());
  auto other = s.line(a_payer());
  AppearScene::One a(s, one, "a"), b(s, one, "b"), c(s, one, "c"), d(s, other, "d");
  EXPECT_EQ(a.ask(), kNow);
  EXPECT_EQ(b.ask(), kNow);
  EXPECT_EQ(c.ask(), kSoon);
  EXPECT_EQ(d.ask(), kSoon);
  s.pass(499us);
  EXPECT_EQ(s.made, (Names{"a", "b"}));
  s.pass(1us);
  EXPECT_EQ(s.made, (Names{"a", "b", "c"}));
  EXPECT_EQ(d.ask(), kSoon);  // it keeps its place
  s.pass(500us);
  EXPECT_EQ(s.made, (Names{"a", "b", "c", "d"}));
  EXPECT_EQ(s.all.deadline(), std::nullopt);
}

TEST(Appearing, WhoHasUsedUpItsPaceDoesNotHoldUpOthers) {
  AppearScene s;
  auto one = s.line(a_payer(), 2);
  auto other = s.line(a_payer(), 2);
  AppearScene::One a(s, one, "a"), b(s, one, "b"), c(s, one, "c"), d(s, one, "d"), e(s, other, "e");
  a.ask();
  b.ask();
  EXPECT_EQ(c.ask(), kLate);
  EXPECT_EQ(c.ask(), kSoon);  // said once
  EXPECT_EQ(d.ask(), kLate);
  e.ask();
  s.pass(1ms);
  EXPECT_EQ(s.made, (Names{"a", "b", "e"}));
  s.pass(4ms);
  EXPECT_EQ(s.made, (Names{"a", "b", "e", "c"}));
  s.pass(5ms);
  EXPECT_EQ(s.made.back(), "d");
}

// N9: what comes and goes without end is paid by every process of the graph.
TEST(Appearing, WhatComesAndGoesForEverHasASlowerPace) {
  AppearScene s;
  Appearing all{8, 500us};
  Appearing::Line line(&all, a_payer(), 512, 5ms);
  const auto appear = [&](int count) {
    int made = 0;
    for (int i = 0; i < count; ++i) {
      AppearScene::One one(s, line, "x");
      made += one.ask() == kNow ? 1 : 0;
      s.now.steady += 5ms;
    }
    return made;
  };
  const int most = Appearing::Line::kSustainedAtOnce;
  EXPECT_GE(appear(most), most - 1) << "a large graph, twice";
  appear(most / 4);
  EXPECT_EQ(appear(2000), 200) << "then 20 in a second";
}

TEST(Appearing, WhoHasUsedLeastOfTheLoopIsNext) {
  AppearScene s;
  const Payer busy = a_payer();
  auto one = s.line(busy);
  auto other = s.line(a_payer());
  AppearScene::One a(s, one, "a"), b(s, one, "b"), c(s, one, "c"), d(s, other, "d"),
      e(s, other, "e");
  for (AppearScene::One* each : {&a, &b, &c, &d, &e}) each->ask();
  busy->add(10ms, s.now.steady);
  s.pass(10ms);
  EXPECT_EQ(s.made, (Names{"a", "b", "d", "e", "c"}));
}

TEST(Appearing, PacketsOfWhoHasUsedLessComeFirstForAWhile) {
  AppearScene s;
  const Payer busy = a_payer(), calm = a_payer();
  busy->add(1h, s.now.steady);
  auto line = s.line(busy);
  AppearScene::One a(s, line, "a"), b(s, line, "b"), c(s, line, "c"), d(s, line, "d");
  for (AppearScene::One* each : {&a, &b, &c, &d}) each->ask();
  s.packets.wait({{1}, false, {}}, calm, s.now.steady);
  s.pass(499ms);
  EXPECT_EQ(s.made, (Names{"a", "b"}));
  s.pass(2ms);
  EXPECT_EQ(s.made, (Names{"a", "b", "c"}));  // it has waited for long
  s.pass(400ms);
  EXPECT_EQ(s.made.size(), 3U);
  s.packets.take(s.now.steady);
  s.pass(1ms);
  EXPECT_EQ(s.made.size(), 4U);
}

TEST(Appearing, WhatIsNotWantedAnyMoreHoldsUpNobody) {
  AppearScene s;
  auto line = s.line(a_payer(), 3);
  AppearScene::One a(s, line, "a"), b(s, line, "b"), c(s, line, "c"), e(s, line, "e");
  auto d = std::make_unique<AppearScene::One>(s, line, "d");
  for (AppearScene::One* each : {&a, &b, &c, d.get(), &e}) each->ask();
  c.wanted = false;
  d.reset();
  s.pass(1ms);
  EXPECT_EQ(s.made, (Names{"a", "b", "e"}));
  c.wanted = true;
  EXPECT_EQ(c.ask(), kLate);  // the turn is over
}

TEST(Appearing, WhoMovesToAnotherIdentityWaitsThere) {
  AppearScene s;
  auto busy = s.line(a_payer(), 2);
  auto calm = s.line(a_payer(), 2);
  AppearScene::One a(s, busy, "a"), b(s, busy, "b"), c(s, busy, "c");
  for (AppearScene::One* each : {&a, &b, &c}) each->ask();
  c.line = &calm;
  EXPECT_EQ(c.ask(), kSoon);
  s.pass(500us);
  EXPECT_EQ(s.made.back(), "c");
}

TEST(Appearing, ALineMayEndBeforeWhatWaits) {
  AppearScene s;
  auto line = std::make_unique<Appearing::Line>(&s.all, a_payer(), 1, 5ms);
  AppearScene::One a(s, *line, "a"), b(s, *line, "b");
  a.ask();
  b.ask();
  line.reset();
  EXPECT_EQ(s.all.deadline(), std::nullopt);
  auto other = s.line(a_payer());
  b.line = &other;
  EXPECT_EQ(b.ask(), kNow);
}

}  // namespace
}  // namespace connect_bridge::test
