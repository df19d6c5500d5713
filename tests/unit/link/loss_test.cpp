// What the end of a connection means for its link.
#include "core/link/loss.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <optional>

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
  void hear(std::int64_t at) {
    link.connection->on_packet(false, Payload::adopt(bytes_of(TimeRequest{1})), now_ms(at));
  }
  [[nodiscard]] Loss end(CloseCode code, std::int64_t at) const {
    return loss_by(Error{code, ""}, link, now_ms(at));
  }
  void lose(Loss loss, std::int64_t at) {
    await_return(link, loss, std::chrono::seconds(3), now_ms(at));
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
  s.link.resume_for = std::chrono::seconds(10);
  s.hear(500);
  s.lose(Loss::kBreak, 1000);
  EXPECT_TRUE(s.link.returns);
  EXPECT_EQ(s.link.dead_at, now_ms(3500).steady);
  EXPECT_EQ(s.link.forgotten_at, now_ms(11'000).steady);
}

TEST(Loss, ALinkIsNotForgottenBeforeItIsDead) {
  for (const int resume_ms : {0, 1000}) {
    Losing s;
    s.link.resume_for = std::chrono::milliseconds(resume_ms);
    s.lose(Loss::kBreak, 1000);
    EXPECT_EQ(s.link.dead_at, now_ms(3000).steady);
    EXPECT_EQ(s.link.forgotten_at, now_ms(3000).steady);
  }
}

// Not in the past: what it had is ended at the next step.
TEST(Loss, ALinkThatWasSilentForLongerIsDeadNow) {
  Losing s;
  s.link.resume_for = std::chrono::seconds(10);
  s.lose(Loss::kBreak, 9000);
  EXPECT_EQ(s.link.dead_at, now_ms(9000).steady);
  EXPECT_EQ(s.link.forgotten_at, now_ms(19'000).steady);
}

TEST(Loss, MirrorsOfAPeerThatRestartsWaitButNothingIsKeptForIt) {
  Losing s;
  s.link.resume_for = std::chrono::seconds(10);
  s.lose(Loss::kRestart, 1000);
  EXPECT_FALSE(s.link.returns);
  EXPECT_EQ(s.link.dead_at, now_ms(3000).steady);
  EXPECT_EQ(s.link.forgotten_at, now_ms(3000).steady);
}

TEST(Loss, ASilentPeerIsDeadAtOnceAndMayReturn) {
  Losing s;
  s.link.resume_for = std::chrono::seconds(10);
  s.lose(Loss::kSilence, 1000);
  EXPECT_TRUE(s.link.returns);
  EXPECT_EQ(s.link.dead_at, now_ms(1000).steady);
  EXPECT_EQ(s.link.forgotten_at, now_ms(11'000).steady);
}

TEST(Loss, AfterItsEndALinkIsDeadAndForgottenAtOnce) {
  Losing s;
  s.link.resume_for = std::chrono::seconds(10);
  s.link.returns = true;  // of a break before
  s.lose(Loss::kEnd, 1000);
  EXPECT_FALSE(s.link.returns);
  EXPECT_EQ(s.link.dead_at, now_ms(1000).steady);
  EXPECT_EQ(s.link.forgotten_at, now_ms(1000).steady);
}

}  // namespace
}  // namespace connect_bridge::link_test
