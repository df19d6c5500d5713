#include "core/link/last_failure.hpp"

#include <gtest/gtest.h>

#include <string>
#include <variant>

#include "unit/flow/script.hpp"

namespace connect_bridge {
namespace {

struct ToldFailures {
  Outputs outputs;
  LastFailure failure{outputs};

  // What is logged when a dial fails so at this minute.
  std::string fail(std::int64_t minute, const std::string& reason) {
    failure.tell(
        {LogLevel::kWarn, "cannot connect: ", {Cause::kNoAnswer, reason}, "; trying again"},
        at(minute));
    return logged();
  }
  std::string logged() {
    std::string lines;
    while (const auto action = outputs.next()) lines += std::get<Log>(*action).text;
    return lines;
  }
  static Now at(std::int64_t minute) { return flow_test::now_ms(minute * 60'000); }
};

TEST(LastFailure, IsToldAgainAfterAMinuteThenEveryTenMinutes) {
  ToldFailures t;
  EXPECT_EQ(t.fail(0, "refused"), "cannot connect: refused; trying again");
  EXPECT_EQ(t.fail(0, "refused"), "");
  EXPECT_EQ(t.fail(1, "refused"), "still cannot connect, for 1 min: refused; trying again");
  EXPECT_EQ(t.fail(10, "refused"), "");
  EXPECT_EQ(t.fail(11, "refused"), "still cannot connect, for 11 min: refused; trying again");
  EXPECT_EQ(t.fail(20, "refused"), "");
  EXPECT_EQ(t.fail(21, "refused"), "still cannot connect, for 21 min: refused; trying again");
  EXPECT_EQ(t.fail(200, "refused"), "still cannot connect, for 3 h: refused; trying again");
  EXPECT_EQ(t.fail(5 * 24 * 60, "refused"),
            "still cannot connect, for 5 days: refused; trying again");
}

// A relay that limits visitors says so to each of them.
TEST(LastFailure, ARobotWhoseCertificateFailsIsNotAbsent) {
  ToldFailures t;
  const auto fail = [&](std::int64_t minute, Cause cause) {
    t.failure.tell({LogLevel::kWarn, "", {cause, std::string(word_of(cause))}, ""}, t.at(minute));
    return t.logged();
  };
  EXPECT_EQ(fail(0, Cause::kRobotNotAtRelay), "robot_not_at_relay");
  EXPECT_EQ(fail(1, Cause::kCertificateForeign), "certificate_foreign");
  EXPECT_EQ(fail(2, Cause::kRobotNotAtRelay), "");
  EXPECT_EQ(t.failure.last().cause, Cause::kCertificateForeign);
  EXPECT_EQ(fail(12, Cause::kRobotNotAtRelay), "robot_not_at_relay");
  EXPECT_EQ(t.failure.last().cause, Cause::kRobotNotAtRelay);
}

TEST(LastFailure, AnotherReasonIsToldAtOnce) {
  ToldFailures t;
  t.fail(0, "refused");
  EXPECT_EQ(t.fail(1, "no route"), "cannot connect: no route; trying again");
  EXPECT_EQ(t.fail(2, "no route"), "");
  EXPECT_EQ(t.fail(11, "no route"), "still cannot connect, for 11 min: no route; trying again");
  EXPECT_EQ(t.failure.last().text, "no route");
}

// Both sides may end a login that takes too long, now the one first and now the other.
TEST(LastFailure, TwoReasonsThatTakeTurnsAreToldOnce) {
  ToldFailures t;
  t.fail(0, "no complete login in time");
  EXPECT_EQ(t.fail(1, "it says: no login"), "cannot connect: it says: no login; trying again");
  for (int minute = 2; minute < 10; minute += 2) {
    EXPECT_EQ(t.fail(minute, "no complete login in time"), "");
    EXPECT_EQ(t.fail(minute + 1, "it says: no login"), "");
  }
  EXPECT_EQ(t.fail(10, "no complete login in time"), "");
  EXPECT_EQ(t.fail(11, "it says: no login"),
            "still cannot connect, for 11 min: it says: no login; trying again");
  EXPECT_EQ(t.fail(14, "no complete login in time"),
            "cannot connect: no complete login in time; trying again")
      << "it has not been the reason for long";
}

// A gateway's answer may contain the time, or a number of the request.
TEST(LastFailure, OfReasonsThatNeverRepeatFewAreTold) {
  ToldFailures t;
  int lines = 0;
  for (int dial = 0; dial < 100; ++dial)
    if (!t.fail(dial / 10, "HTTP 503: request " + std::to_string(dial)).empty()) ++lines;
  EXPECT_EQ(lines, LastFailure::kNews + 1) << "the last one after the first minute";
  EXPECT_EQ(t.failure.last().text, "HTTP 503: request 99") << "the status has the last one";
  EXPECT_EQ(t.fail(11, "HTTP 503: request 100"),
            "still cannot connect, for 11 min: HTTP 503: request 100; trying again");
  EXPECT_EQ(t.fail(18, "wrong certificate"), "");
  EXPECT_EQ(t.fail(18, "wrong certificate"), "cannot connect: wrong certificate; trying again");
  EXPECT_EQ(t.fail(19, "HTTP 503: request 101"), "");
  EXPECT_EQ(t.fail(28, "refused"), "still cannot connect, for 28 min: refused; trying again");
  EXPECT_EQ(t.fail(38, "refused"), "still cannot connect, for 38 min: refused; trying again");
  EXPECT_EQ(t.fail(39, "no route"), "cannot connect: no route; trying again");
}

TEST(LastFailure, WhatWasToldElsewhereIsNotToldAgainSoon) {
  ToldFailures t;
  t.failure.set({Cause::kNoAnswer, "it is silent"}, ToldFailures::at(0));
  EXPECT_EQ(t.fail(0, "it is silent"), "");
  EXPECT_EQ(t.fail(1, "it is silent"),
            "still cannot connect, for 1 min: it is silent; trying again");
}

TEST(LastFailure, ALinkThatOpensBeginsAnew) {
  ToldFailures t;
  t.fail(0, "refused");
  t.failure.clear();
  EXPECT_FALSE(t.failure.last());
  EXPECT_EQ(t.fail(30, "refused"), "cannot connect: refused; trying again");
  EXPECT_EQ(t.fail(40, "refused"), "still cannot connect, for 10 min: refused; trying again");
}

}  // namespace
}  // namespace connect_bridge
