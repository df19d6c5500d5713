// When what a peer accepts is looked at.
#include "core/link/link.hpp"

#include "core/link/link_accepts.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>

#include "unit/link/quiet_user.hpp"
#include "unit/link/script.hpp"

namespace connect_bridge::link_test {
namespace {

// Records the lists that are looked at, each by the first name that it denies; "=" after one that
// says what the one before said.
struct Lists final : QuietUser {
  using QuietUser::on;
  Result<Nothing> on(Link& link, Accepts accepts, const Now&) override {
    looked_at += accepts.deny.front();
    if (!link.accepts.adopt(std::move(accepts))) looked_at += '=';
    return Nothing{};
  }

  std::string looked_at;
};

Accepts denying(const std::string& name) {
  return {{}, {name}};
}

// A link whose connection, which is not needed for this, stays away.
struct Accepting {
  void hear(const std::string& name, std::int64_t at) {
    Control list = denying(name);
    EXPECT_TRUE(link.on_control(list, now_ms(at)));
  }
  // As many as come at once, but the last one.
  void hear_many() {
    for (int i = 0; i < 19; ++i) hear(std::to_string(i % 2), 0);
    looked_at();
  }
  // Links of its identity have told so much that it is not looked at for more than a minute.
  void many_of_others(std::int64_t at) {
    for (int i = 0; i < 230; ++i) static_cast<void>(account->accepts.reserve(now_ms(at).steady));
  }
  std::string looked_at() { return std::exchange(user.looked_at, ""); }

  Lists user;
  std::shared_ptr<Account> account = std::make_shared<Account>();
  Link link{{1}, user, account};
};

TEST(LinkAccepts, OfListsThatComeTooFastTheLastIsLookedAtLater) {
  Accepting s;
  s.hear_many();
  s.hear("a", 0);
  EXPECT_EQ(s.looked_at(), "a");
  EXPECT_FALSE(s.link.accepts.deadline());
  s.hear("b", 100);
  s.hear("c", 200);
  const auto due = s.link.accepts.deadline();
  ASSERT_TRUE(due);
  EXPECT_EQ(*due, now_ms(1000).steady);
  s.link.on_time({*due - Duration(1), 0, 0});
  EXPECT_EQ(s.looked_at(), "");
  s.link.on_time({*due, 0, 0});
  EXPECT_EQ(s.looked_at(), "c");
  EXPECT_FALSE(s.link.accepts.deadline());
}

// By the list between the peer may have declined what it takes again now.
TEST(LinkAccepts, AListIsTheSameUnlessAnotherWasPassedOver) {
  Accepting s;
  s.hear_many();
  s.hear("a", 0);
  const auto lists = s.link.accepts.lists();
  s.hear("a", 1500);
  EXPECT_EQ(s.looked_at(), "aa=");
  EXPECT_EQ(s.link.accepts.lists(), lists);
  s.hear("b", 1600);
  s.hear("a", 1700);
  s.link.on_time(now_ms(2500));
  EXPECT_EQ(s.looked_at(), "a");
  EXPECT_EQ(s.link.accepts.lists(), lists + 1);
  s.hear("a", 3500);
  EXPECT_EQ(s.looked_at(), "a=");
}

// Other links of the identity were heard meanwhile.
TEST(LinkAccepts, WhatOthersOfTheIdentityTellPutsItOffMore) {
  Accepting s;
  s.hear_many();
  s.hear("a", 0);
  s.hear("b", 100);
  s.many_of_others(200);
  s.link.on_time(now_ms(1000));
  EXPECT_EQ(s.looked_at(), "a");
  ASSERT_TRUE(s.link.accepts.deadline());
  EXPECT_GT(*s.link.accepts.deadline(), now_ms(60'000).steady);
  s.link.on_time({*s.link.accepts.deadline(), 0, 0});
  EXPECT_EQ(s.looked_at(), "b");
}

// The peer keeps its mirrors of an earlier connection for 30 s.
TEST(LinkAccepts, TheFirstListOfAConnectionIsLookedAtWithinTenSecondsWhateverOthersTell) {
  Accepting s;
  s.many_of_others(0);
  s.link.life.opened(now_ms(0));
  s.hear("a", 1000);
  EXPECT_EQ(s.link.accepts.deadline(), now_ms(10'000).steady);
  s.link.on_time(now_ms(10'000));
  EXPECT_EQ(s.looked_at(), "a");
  s.hear("b", 11'000);
  s.link.on_time(now_ms(20'000));
  EXPECT_EQ(s.looked_at(), "");
}

TEST(LinkAccepts, AListThatWaitsGoesWithItsConnection) {
  Accepting s;
  s.hear_many();
  s.hear("a", 0);
  s.hear("b", 100);
  s.link.drop_connection();
  EXPECT_FALSE(s.link.accepts.deadline());
  s.link.on_time(now_ms(60'000));
  EXPECT_EQ(s.looked_at(), "a");
}

}  // namespace
}  // namespace connect_bridge::link_test
