#include "core/driving/wheel.hpp"

#include <gtest/gtest.h>

#include <iostream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "unit/driving/samples.hpp"

namespace connect_bridge::driving {
namespace {

using std::chrono::milliseconds;

TimePoint at_ms(std::int64_t n) {
  return TimePoint{} + milliseconds(n);
}

// a and c are publishers of anna on link 1, b is bob's on link 2, d is a's publisher on link 3, of
// another identity.
Driver driver_of(const std::string& who) {
  const std::map<std::string, Driver> drivers = {
      {"a", {"anna", {1}, {{1}}, "ops"}},
      {"b", {"bob", {2}, {{2}}, "guests"}},
      {"c", {"anna", {1}, {{3}}, "ops"}},
      {"d", {"dora", {3}, {{1}}, "guests"}},
  };
  return drivers.at(who);
}

// "300 a move" is a command of a after 300 ms, "300 time" a look at the time. A neutral is "stop"
// if nothing came before it, else "zeros". "press" is a command after half a second, "succeeds" one
// after the end of the holder's publisher. Deadlines run by themselves. The result is a word for
// each step and event.
class Script {
 public:
  explicit Script(std::optional<Duration> halt_after = milliseconds(300), bool let_go = true)
      : rules_{halt_after, let_go} {}

  std::string run(const std::string& script) {
    std::istringstream steps(script);
    for (std::string step; std::getline(steps, step, ';');) {
      std::istringstream words(step);
      std::int64_t at = 0;
      std::string who, what;
      words >> at >> who >> what;
      pass_to(at_ms(at));
      if (who != "time") act(who, what, at_ms(at));
    }
    return std::exchange(done_, {});
  }
  Wheel wheel;

 private:
  void say(const std::string& word) { done_ += (done_.empty() ? "" : " ") + word; }
  void pass_to(TimePoint until) {
    while (wheel.deadline() && *wheel.deadline() <= until) {
      const TimePoint due = *wheel.deadline();
      tell(wheel.on_time(due));
    }
  }
  void act(const std::string& who, const std::string& what, TimePoint now) {
    const Driver driver = driver_of(who);
    if (what == "take") return tell(wheel.take(driver, now));
    if (what == "leave") return tell(wheel.leave(driver, now));
    if (what == "old") return wheel.on_old(driver.origin);
    if (what == "ends")
      return tell(wheel.on_end(driver.identity, driver.link, WheelCause::kLinkLost, now));
    if (what == "loses_right")
      return tell(wheel.on_end(driver.identity, driver.link, WheelCause::kRight, now));
    const bool gone = what == "succeeds";
    const bool moves = what == "move" || what == "press" || gone;
    const OriginSeen::Noted seen{what == "stop", what == "press"};
    const Payload raw = driving_test::twist(moves ? 1 : 0);
    const auto step =
        wheel.on_command({driver, seen, raw, moves, milliseconds(20), gone}, rules_, now);
    say(step.publishes ? "yes" : "no");
    tell(step);
  }
  void tell(const WheelStep& step) {
    if (step.zero)
      say("zero" + std::to_string(step.zero->origin.bytes[0]) +
          (step.zero->last.empty() ? "?" : ""));
    for (const auto& identity : step.flagged)
      wheel.confine(identity,
                    identity == "anna" ? std::vector<Gid>{{{1}}, {{3}}} : std::vector<Gid>{{{2}}});
    for (const auto& event : step.events) {
      const std::string what = event.what == WheelEvent::What::kTaken    ? "taken"
                               : event.what == WheelEvent::What::kHalted ? "halted"
                                                                         : "left";
      std::ostringstream text;
      text << what << ':' << event.who.identity << ':' << name_of(event.cause);
      if (event.what != WheelEvent::What::kTaken) text << ':' << event.commands;
      say(text.str());
    }
  }

  WheelRules rules_;
  std::string done_;
};

struct Case {
  const char* name;
  const char* script;
  const char* expected;
};

std::ostream& operator<<(std::ostream& out, const Case& c) {
  return out << c.name;
}

// The table of docs/driving.md: state by state, input by input.
class WheelTable : public testing::TestWithParam<Case> {};

TEST_P(WheelTable, Holds) {
  Script script;
  EXPECT_EQ(script.run(GetParam().script), GetParam().expected);
}

constexpr Case kHalting[] = {
    // ---- free
    {"free_neutral", "0 a stop; 10 b zeros", "yes yes"},
    {"free_moves", "0 a move", "yes taken:anna:moved"},
    {"free_take", "0 a take; 900 b move", "taken:anna:taken no"},
    {"free_leave", "0 a leave", ""},
    {"free_ends", "0 a ends", ""},
    {"free_flagged", "0 a move; 1000 time; 1500 a move; 1550 a stop; 1600 a move",
     "yes taken:anna:moved zero1 halted:anna:silence:1 zero1 zero1 left:anna:silence:1 no yes yes "
     "taken:anna:moved"},
    // ---- resting
    {"resting_neutrals", "0 a move; 50 a zeros; 60 b zeros; 70 a zeros",
     "yes taken:anna:moved yes yes yes"},
    {"resting_holder_moves", "0 a move; 50 a zeros; 100 a move", "yes taken:anna:moved yes yes"},
    {"resting_another_early", "0 a move; 50 a zeros; 999 b move", "yes taken:anna:moved yes no"},
    {"resting_another_late", "0 a move; 50 a zeros; 1000 b move",
     "yes taken:anna:moved yes left:anna:silence:1 yes taken:bob:moved"},
    {"resting_silent", "0 a move; 50 a zeros; 700 time", "yes taken:anna:moved yes"},
    {"resting_ends", "0 a move; 50 a zeros; 60 a ends; 70 b move",
     "yes taken:anna:moved yes left:anna:link_lost:1 yes taken:bob:moved"},
    {"resting_take", "0 a move; 50 a zeros; 60 b take; 70 a move; 80 b move",
     "yes taken:anna:moved yes left:anna:taken:1 taken:bob:taken no yes"},
    {"resting_leave", "0 a move; 50 a zeros; 60 a leave; 70 b move",
     "yes taken:anna:moved yes left:anna:given:1 yes taken:bob:moved"},
    // ---- moving
    {"moving_neutral", "0 a move; 50 a zeros; 600 time", "yes taken:anna:moved yes"},
    {"moving_stop_of_another", "0 a move; 50 b stop; 60 a move; 300 time",
     "yes taken:anna:moved yes zero1 halted:anna:stopped:1 no zero1 zero1"},
    {"moving_zeros_of_another", "0 a move; 50 b zeros; 60 a move", "yes taken:anna:moved no yes"},
    {"moving_goes_on", "0 a move; 250 a move; 500 a move; 750 a move",
     "yes taken:anna:moved yes yes yes"},
    {"moving_old_is_no_life", "0 a move; 100 a old; 200 a old; 299 time", "yes taken:anna:moved"},
    {"moving_old", "0 a move; 100 a old; 200 a old; 300 time",
     "yes taken:anna:moved zero1 halted:anna:age:1"},
    {"moving_another", "0 a move; 50 b move; 100 a move", "yes taken:anna:moved no yes"},
    {"moving_another_publisher", "0 a move; 50 c move; 100 a move", "yes taken:anna:moved no yes"},
    {"moving_silent", "0 a move; 299 time; 300 time; 379 time; 380 time; 460 time; 900 time",
     "yes taken:anna:moved zero1 halted:anna:silence:1 zero1 zero1"},
    {"moving_ends", "0 a move; 50 a ends; 60 b move",
     "yes taken:anna:moved zero1 halted:anna:link_lost:1 left:anna:link_lost:1 yes "
     "taken:bob:moved"},
    {"moving_right", "0 a move; 50 a loses_right; 90 time",
     "yes taken:anna:moved zero1 halted:anna:right:1 left:anna:right:1"},
    {"moving_end_of_another", "0 a move; 50 b ends; 60 a move", "yes taken:anna:moved yes"},
    {"moving_take", "0 a move; 50 b take; 60 a move; 70 b move; 80 a move",
     "yes taken:anna:moved zero1 halted:anna:taken:1 left:anna:taken:1 taken:bob:taken no yes no"},
    {"moving_leave", "0 a move; 50 a leave; 60 b move",
     "yes taken:anna:moved zero1 halted:anna:given:1 left:anna:given:1 yes taken:bob:moved"},
    {"moving_own_take", "0 a move; 50 a take; 60 a move", "yes taken:anna:moved yes"},
    // To take what one has is no sign of life, but the wheel is held for longer.
    {"own_take_is_no_life", "0 a move; 250 a take; 300 time; 1100 b move",
     "yes taken:anna:moved zero1 halted:anna:silence:1 zero1 zero1 no"},
    // The holder's other publisher.
    {"own_other_at_rest", "0 a move; 50 a zeros; 60 c move; 70 a move; 80 c zeros; 90 b move",
     "yes taken:anna:moved yes yes no yes no"},
    {"own_other_after_an_end", "0 a move; 50 c succeeds; 60 c move; 400 time",
     "yes taken:anna:moved yes yes zero3 halted:anna:silence:3"},
    {"another_after_an_end", "0 a move; 50 b succeeds", "yes taken:anna:moved no"},
    {"own_other_pressed_anew", "0 a move; 310 c press; 320 c move",
     "yes taken:anna:moved zero1 halted:anna:silence:1 yes yes"},
    // ---- let go first
    {"held_stick", "0 a move; 310 a move; 400 a move; 2000 a move",
     "yes taken:anna:moved zero1 halted:anna:silence:1 no zero1 no zero1 left:anna:silence:1 no"},
    {"pressed_anew", "0 a move; 310 a press; 400 a move",
     "yes taken:anna:moved zero1 halted:anna:silence:1 yes yes"},
    {"own_zeros", "0 a move; 310 a zeros; 320 a move",
     "yes taken:anna:moved zero1 halted:anna:silence:1 yes yes"},
    {"zeros_of_own_panel", "0 a move; 310 c zeros; 320 a move",
     "yes taken:anna:moved zero1 halted:anna:silence:1 yes no"},
    {"stop_of_own_panel", "0 a move; 310 c stop; 320 a move",
     "yes taken:anna:moved zero1 halted:anna:silence:1 yes yes"},
    {"flag_of_the_identity", "0 a move; 1310 c move",
     "yes taken:anna:moved zero1 halted:anna:silence:1 zero1 zero1 left:anna:silence:1 no"},
    {"stop_of_another_clears_nothing", "0 a move; 1310 b stop; 1320 a move",
     "yes taken:anna:moved zero1 halted:anna:silence:1 zero1 zero1 left:anna:silence:1 yes no"},
    {"flag_outlives_the_link", "0 a move; 50 a ends; 60000 a move",
     "yes taken:anna:moved zero1 halted:anna:link_lost:1 left:anna:link_lost:1 zero1 zero1 no"},
    {"flag_expires", "0 a move; 50 a ends; 60050 a move",
     "yes taken:anna:moved zero1 halted:anna:link_lost:1 left:anna:link_lost:1 zero1 zero1 yes "
     "taken:anna:moved"},
    {"flag_follows_the_publisher", "0 a move; 310 d move; 320 d zeros; 330 d move",
     "yes taken:anna:moved zero1 halted:anna:silence:1 no yes yes"},
    // Zeros under way do not stop the next command.
    {"zeros_end", "0 a move; 310 a press; 600 time",
     "yes taken:anna:moved zero1 halted:anna:silence:1 yes"},
    // Another way to the same publisher.
    {"feeder_changes", "0 a move; 50 d move; 60 b move; 70 a ends; 80 d move",
     "yes taken:anna:moved yes no yes"},
};
INSTANTIATE_TEST_SUITE_P(Halting, WheelTable, testing::ValuesIn(kHalting),
                         [](const auto& row) { return std::string(row.param.name); });

// Without `halt_after`.
class WheelWithoutHalt : public WheelTable {};
TEST_P(WheelWithoutHalt, Holds) {
  Script script(std::nullopt);
  EXPECT_EQ(script.run(GetParam().script), GetParam().expected);
}
constexpr Case kPlain[] = {
    {"silence_frees", "0 a move; 999 b move; 1000 b move",
     "yes taken:anna:moved no left:anna:silence:1 yes taken:bob:moved"},
    {"goes_on_after_silence", "0 a move; 2000 a move",
     "yes taken:anna:moved left:anna:silence:1 yes taken:anna:moved"},
    {"end_halts_nothing", "0 a move; 50 a ends; 60 a move",
     "yes taken:anna:moved left:anna:link_lost:1 yes taken:anna:moved"},
    // Another took the wheel: a stick that was held all the time lets go first.
    {"taken_over", "0 a move; 1000 b move; 1100 a move; 3000 a move; 3010 a stop; 3020 a move",
     "yes taken:anna:moved left:anna:silence:1 yes taken:bob:moved no left:bob:silence:1 no yes "
     "yes taken:anna:moved"},
    {"taken_over_at_rest", "0 a move; 10 a zeros; 1000 b move; 3000 a move",
     "yes taken:anna:moved yes left:anna:silence:1 yes taken:bob:moved left:bob:silence:1 yes "
     "taken:anna:moved"},
    {"own_other_publisher", "0 a move; 1000 c move; 2500 a move",
     "yes taken:anna:moved left:anna:silence:1 yes taken:anna:moved left:anna:silence:1 yes "
     "taken:anna:moved"},
    {"stop_of_another", "0 a move; 50 b stop; 60 a move; 300 time",
     "yes taken:anna:moved yes zero1 halted:anna:stopped:1 no zero1 zero1"},
    // Who is long silent is not halted; a stick that is still held lets go first.
    {"take_after_silence", "0 a move; 5000 b take; 5010 a move; 7000 a move",
     "yes taken:anna:moved left:anna:silence:1 taken:bob:taken no left:bob:silence:0 no"},
    {"leave_after_silence", "0 a move; 5000 a leave; 5010 a move",
     "yes taken:anna:moved left:anna:silence:1 yes taken:anna:moved"},
    {"take_while_it_moves", "0 a move; 500 b take",
     "yes taken:anna:moved zero1 halted:anna:taken:1 left:anna:taken:1 taken:bob:taken"},
};
INSTANTIATE_TEST_SUITE_P(Plain, WheelWithoutHalt, testing::ValuesIn(kPlain),
                         [](const auto& row) { return std::string(row.param.name); });

TEST(Wheel, AControllerThatNeverLetsGoGoesOn) {
  Script script(milliseconds(300), false);
  EXPECT_EQ(script.run("0 a move; 310 a move; 320 b move"),
            "yes taken:anna:moved zero1 halted:anna:silence:1 yes no");
}

// The frame of a command is the peer's, and may be as long as a message.
TEST(Wheel, ALargeCommandIsNotKept) {
  const auto kept = [](std::size_t frame) {
    Wheel wheel;
    const Payload raw = driving_test::twist_stamped(kStampSecond, 1, std::string(frame, 'f'));
    static_cast<void>(wheel.on_command({.who = driver_of("a"), .seen = {}, .raw = raw},
                                       {milliseconds(300), true}, at_ms(0)));
    return wheel.on_time(at_ms(300)).zero->last.size();
  };
  EXPECT_GT(kept(900), 900U);
  EXPECT_EQ(kept(1024), 0U);
}

TEST(Wheel, APublisherThatComesLaterHasLetGo) {
  Script script;
  script.run("0 a move; 1310 time");
  script.wheel.confine("anna", {{{1}}});
  EXPECT_EQ(script.run("1320 c move"), "yes taken:anna:moved");
}

TEST(Wheel, AMirrorLivesUntilItsHaltIsHeard) {
  Script script;
  script.run("0 a move");
  EXPECT_EQ(script.wheel.needs({{1}}), at_ms(800));
  EXPECT_EQ(script.wheel.needs({{2}}), std::nullopt);
  script.run("310 time");
  EXPECT_EQ(script.wheel.needs({{1}}), at_ms(800));
  script.run("500 time");
  EXPECT_EQ(script.wheel.needs({{1}}), std::nullopt);
}

TEST(Wheel, EachIdentityHasItsWord) {
  Script script;
  const auto words = [&](std::int64_t now) {
    return std::pair{script.wheel.word_for("anna", at_ms(now)),
                     script.wheel.word_for("bob", at_ms(now))};
  };
  EXPECT_EQ(words(0), (std::pair{WheelWord::kNobody, WheelWord::kNobody}));
  script.run("0 a move");
  EXPECT_EQ(words(0), (std::pair{WheelWord::kYou, WheelWord::kAnother}));
  EXPECT_EQ(script.wheel.last_moved(at_ms(7)), milliseconds(7));
  script.run("310 time");
  EXPECT_EQ(words(310), (std::pair{WheelWord::kLetGo, WheelWord::kAnother}));
  EXPECT_EQ(words(1000), (std::pair{WheelWord::kLetGo, WheelWord::kNobody}));
}

// Another way to the publisher goes on with the wheel.
TEST(Wheel, TheEndOfALinkThatHasHandedOverHaltsNobody) {
  Script script;
  script.run("0 a move");
  script.wheel.hand_over({3});
  EXPECT_EQ(script.run("50 a ends; 60 d ends"),
            "zero1 halted:anna:link_lost:1 left:anna:link_lost:1");
}

TEST(Wheel, ARuleWithoutAWheelReleasesItsOwnHolder) {
  Script script;
  script.run("0 a move; 10 b move");
  EXPECT_TRUE(script.wheel.on_rule_without({2}).events.empty());
  const auto step = script.wheel.on_rule_without({1});
  EXPECT_FALSE(step.zero);
  ASSERT_EQ(step.events.size(), 1U);
  EXPECT_EQ(step.events[0].what, WheelEvent::What::kLeft);
  EXPECT_EQ(step.events[0].cause, WheelCause::kRight);
  EXPECT_EQ(step.events[0].who.rule, "ops");
  EXPECT_EQ(script.run("50 b move; 360 time"), "yes taken:bob:moved zero2 halted:bob:silence:1");
}

TEST(Wheel, WhatHasEndedIsForgotten) {
  Script script;
  EXPECT_TRUE(script.wheel.is_idle(at_ms(0)));
  script.run("0 a move");
  EXPECT_FALSE(script.wheel.is_idle(at_ms(0)));
  script.run("50 a ends; 300 time");
  EXPECT_FALSE(script.wheel.is_idle(at_ms(300)));
  EXPECT_TRUE(script.wheel.is_idle(at_ms(60'050)));
}

// ---- what was seen of a publisher

OriginSeen::Noted noted(OriginSeen& seen, std::int64_t at, std::uint64_t number,
                        std::int64_t published, std::uint64_t connection = 1,
                        std::uint16_t demand = 1, Duration pause = kPressedAnew) {
  constexpr Stamp kBegin = 1'700'000'000'000'000'000;
  seen.note({{connection}, demand, number, kBegin + published * 1'000'000}, at_ms(at), pause);
  return seen.last();
}

TEST(WheelSeen, AKeyIsPressedAnewAfterHalfASecond) {
  OriginSeen seen;
  EXPECT_FALSE(noted(seen, 0, 1, 0).pressed);
  EXPECT_FALSE(noted(seen, 499, 2, 499).pressed);
  EXPECT_TRUE(noted(seen, 999, 3, 999).pressed);
  // Only the times of publication count: the path was blocked.
  EXPECT_FALSE(noted(seen, 5000, 4, 1049).pressed);
}

TEST(WheelSeen, WhatWasLostInBetweenMayHaveBeenHeld) {
  OriginSeen seen;
  noted(seen, 0, 1, 0);
  EXPECT_FALSE(noted(seen, 1000, 3, 1000).pressed);
  EXPECT_FALSE(noted(seen, 2000, 4, 2000, 2).pressed);     // another connection
  EXPECT_FALSE(noted(seen, 3000, 5, 3000, 2, 2).pressed);  // another demand
  EXPECT_TRUE(noted(seen, 4000, 6, 4000, 2, 2).pressed);
  OriginSeen without;
  noted(without, 0, 0, 0);
  EXPECT_FALSE(noted(without, 1000, 0, 1000).pressed);
}

TEST(WheelSeen, AKeyIsPressedAnewAfterAShorterHalt) {
  OriginSeen seen;
  const auto pressed = [&](std::int64_t at, std::uint64_t number) {
    return noted(seen, at, number, at, 1, 1, milliseconds(200)).pressed;
  };
  EXPECT_FALSE(pressed(0, 1));
  EXPECT_FALSE(pressed(199, 2));
  EXPECT_TRUE(pressed(399, 3));
}

// `ros2 topic pub` repeats once a second.
TEST(WheelSeen, APublisherIsAloneAfterASecondAndAHalf) {
  OriginSeen seen;
  EXPECT_TRUE(noted(seen, 0, 1, 0).alone);
  EXPECT_FALSE(noted(seen, 1020, 2, 1000).alone);
  EXPECT_FALSE(noted(seen, 2519, 3, 2499).alone);
  EXPECT_TRUE(noted(seen, 4019, 4, 3999).alone);
}

// A path was blocked, or lost samples: the panel has repeated its zeros all the time.
TEST(WheelSeen, AStreamThatComesLateIsNotAlone) {
  OriginSeen seen;
  noted(seen, 0, 1, 0);
  EXPECT_FALSE(noted(seen, 5000, 2, 100).alone);
  EXPECT_FALSE(noted(seen, 9000, 41, 4000, 2, 3).alone);
  EXPECT_FALSE(noted(seen, 12'000, 42, 2000).alone);  // its clock was set
  EXPECT_TRUE(noted(seen, 15'000, 44, 5000).alone);
  EXPECT_TRUE(noted(seen, 18'000, 1, 5010).alone);  // numbers begin again
  EXPECT_FALSE(noted(seen, 21'000, ~std::uint64_t{0}, 5020).alone);
  OriginSeen without;
  noted(without, 0, 0, 0);
  EXPECT_TRUE(noted(without, 1500, 0, 10).alone);
}

}  // namespace
}  // namespace connect_bridge::driving
