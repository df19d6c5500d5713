// What the end of a connection means for its link.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "core/link/standing.hpp"
#include "unit/link/script.hpp"
#include "unit/topics/one_link.hpp"

namespace connect_bridge::link_test {
namespace {

constexpr Role kRoles[] = {Role::kServer, Role::kClient};

Loss loss_by_code(CloseCode code, Role role) {
  return loss_by(static_cast<std::uint16_t>(code), role);
}

// An open link that is dead after 3 s of silence, and was heard at 0. Time in milliseconds.
struct Losing {
  explicit Losing(Duration resume_for = std::chrono::seconds(10))
      : one(1, std::make_shared<Account>(), resume_for) {}

  void hear(std::int64_t at) {
    link.connection()->on_packet(false, Payload::adopt(bytes_of(TimeRequest{1})), now_ms(at));
  }
  [[nodiscard]] Loss end(CloseCode code, std::int64_t at) const {
    return loss_by(Error{code, ""}, link, now_ms(at));
  }
  void lose(Loss loss, std::int64_t at) { link.lose(loss, now_ms(at)); }
  // When it is dead, and if something resumes, when it is forgotten: "3500, 11000".
  std::string ends() {
    const std::string dead = at_deadline();
    link.life.died(true, now_ms(0));
    return dead + ", " + at_deadline();
  }
  [[nodiscard]] std::string at_deadline() const {
    return std::to_string((link.life.deadline().value() - TimePoint{}) /
                          std::chrono::milliseconds(1));
  }

  topics_test::OneLink one;
  Link& link = one.link;
};

TEST(Loss, AClientThatSaysGoodbyeHasEndedAndAServerThatDoesRestarts) {
  for (const auto code : {CloseCode::kNormal, CloseCode::kGoingAway}) {
    EXPECT_EQ(loss_by_code(code, Role::kServer), Loss::kEnd);
    EXPECT_EQ(loss_by_code(code, Role::kClient), Loss::kRestart);
  }
}

TEST(Loss, WhoseLoginWasWithdrawnIsForgottenByThePeer) {
  for (const Role role : kRoles) EXPECT_EQ(loss_by_code(CloseCode::kRevoked, role), Loss::kRestart);
}

// The code is any number that the peer, or something between, has sent.
TEST(Loss, WhateverElseThePeerSaysItMayComeBack) {
  for (const Role role : kRoles) {
    EXPECT_EQ(loss_by(std::nullopt, role), Loss::kBreak);
    for (const int code : {0, 999, 1002, 1006, 1011, 4005, 4008, 4014, 4016, 4017, 65'535})
      EXPECT_EQ(loss_by(static_cast<std::uint16_t>(code), role), Loss::kBreak) << code;
  }
}

TEST(Loss, OfAPeerWhoseLoginWeWithdrawNothingIsLeft) {
  const Losing s;
  EXPECT_EQ(s.end(CloseCode::kRevoked, 0), Loss::kEnd);
  EXPECT_EQ(s.end(CloseCode::kRevoked, 3000), Loss::kEnd);
}

// After a change of the network silence is noticed within a third of that.
TEST(Loss, APeerThatIsSilentIsDeadOnlyAfterItsWholeTime) {
  Losing s;
  EXPECT_EQ(s.end(CloseCode::kSilent, 2999), Loss::kBreak);
  EXPECT_EQ(s.end(CloseCode::kSilent, 3000), Loss::kSilence);
  s.hear(1000);
  EXPECT_EQ(s.end(CloseCode::kSilent, 3999), Loss::kBreak);
}

TEST(Loss, WhatElseWeEndIsABreakHoweverLongThePeerWasSilent) {
  const Losing s;
  for (const auto code : {CloseCode::kMalformed, CloseCode::kTooLarge, CloseCode::kReplaced,
                          CloseCode::kExpired, CloseCode::kSlowPeer})
    EXPECT_EQ(s.end(code, 10'000), Loss::kBreak);
}

TEST(Loss, AfterABreakTheLinkIsDeadWhenItsSilenceIsLongEnough) {
  Losing s;
  s.hear(500);
  s.lose(Loss::kBreak, 1000);
  EXPECT_TRUE(s.link.life.may_return());
  EXPECT_EQ(s.ends(), "3500, 11000");
}

TEST(Loss, ALinkIsNotForgottenBeforeItIsDead) {
  for (const int resume_ms : {0, 1000}) {
    Losing s{std::chrono::milliseconds(resume_ms)};
    s.lose(Loss::kBreak, 1000);
    EXPECT_EQ(s.ends(), "3000, 3000");
  }
}

// Not in the past: what it had is ended at the next step.
TEST(Loss, ALinkThatWasSilentForLongerIsDeadNow) {
  Losing s;
  s.lose(Loss::kBreak, 9000);
  EXPECT_EQ(s.ends(), "9000, 19000");
}

TEST(Loss, MirrorsOfAPeerThatRestartsWaitButNothingIsKeptForIt) {
  Losing s;
  s.lose(Loss::kRestart, 1000);
  EXPECT_FALSE(s.link.life.may_return());
  EXPECT_EQ(s.ends(), "3000, 3000");
}

TEST(Loss, ASilentPeerIsDeadAtOnceAndMayReturn) {
  Losing s;
  s.lose(Loss::kSilence, 1000);
  EXPECT_TRUE(s.link.life.may_return());
  EXPECT_EQ(s.ends(), "1000, 11000");
}

TEST(Loss, AfterItsEndALinkIsDeadAndForgottenAtOnce) {
  Losing s;
  s.lose(Loss::kBreak, 500);
  s.lose(Loss::kEnd, 1000);
  EXPECT_FALSE(s.link.life.may_return());
  EXPECT_EQ(s.ends(), "1000, 1000");
}

}  // namespace
}  // namespace connect_bridge::link_test
