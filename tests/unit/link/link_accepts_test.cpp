// When what a peer accepts is looked at.
#include "core/link/link.hpp"

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

// It denies `name`, and costs ten seconds of the link's pace.
Accepts long_list(const std::string& name) {
  Accepts accepts;
  accepts.deny.assign(1000, name);
  return accepts;
}

// A link whose connection, which is not needed for this, stays away.
struct Accepting {
  void hear(const std::string& name, std::int64_t at) {
    Control list = long_list(name);
    EXPECT_TRUE(link.on_control(list, now_ms(at)));
  }
  std::string looked_at() { return std::exchange(user.looked_at, ""); }

  Lists user;
  std::shared_ptr<Account> account = std::make_shared<Account>();
  Link link{{1}, user, account};
};

TEST(LinkAccepts, OfListsThatComeTooFastTheLastIsLookedAtLater) {
  Accepting s;
  s.hear("a", 0);
  EXPECT_EQ(s.looked_at(), "a");
  EXPECT_FALSE(s.link.accepts.deadline());
  s.hear("b", 100);
  s.hear("c", 200);
  const auto due = s.link.accepts.deadline();
  ASSERT_TRUE(due);
  EXPECT_GT(*due, now_ms(3000).steady);
  EXPECT_LT(*due, now_ms(10'000).steady);
  s.link.on_time({*due - Duration(1), 0, 0});
  EXPECT_EQ(s.looked_at(), "");
  s.link.on_time({*due, 0, 0});
  EXPECT_EQ(s.looked_at(), "c");
  EXPECT_FALSE(s.link.accepts.deadline());
}

// By the list between the peer may have declined what it takes again now.
TEST(LinkAccepts, AListIsTheSameUnlessAnotherWasPassedOver) {
  Accepting s;
  s.hear("a", 0);
  s.hear("a", 60'000);
  EXPECT_EQ(s.looked_at(), "aa=");
  EXPECT_EQ(s.link.accepts.lists(), 1U);
  s.hear("b", 60'100);
  s.hear("a", 60'200);
  s.link.on_time(now_ms(120'000));
  EXPECT_EQ(s.looked_at(), "a");
  EXPECT_EQ(s.link.accepts.lists(), 2U);
  s.hear("a", 180'000);
  EXPECT_EQ(s.looked_at(), "a=");
}

// Another link of the identity was heard meanwhile: its lists are dear to this one, too.
TEST(LinkAccepts, WhatTheIdentityOwesPutsOffMore) {
  Accepting s;
  s.hear("a", 0);
  s.hear("b", 100);
  s.account->accepts.take(60'000, now_ms(200).steady);  // ten minutes
  s.link.on_time(now_ms(60'000));
  EXPECT_EQ(s.looked_at(), "a");
  ASSERT_TRUE(s.link.accepts.deadline());
  EXPECT_GT(*s.link.accepts.deadline(), now_ms(60'000).steady);
  s.link.on_time(now_ms(700'000));
  EXPECT_EQ(s.looked_at(), "b");
}

// The peer keeps its mirrors of an earlier connection for 30 s.
TEST(LinkAccepts, TheFirstListOfAConnectionIsLookedAtWithinTenSecondsWhateverOthersOwe) {
  Accepting s;
  s.account->accepts.take(60'000, now_ms(0).steady);
  s.link.life.opened(now_ms(0));
  s.hear("a", 1000);
  EXPECT_EQ(s.link.accepts.deadline(), now_ms(10'000).steady);
  s.link.on_time(now_ms(10'000));
  EXPECT_EQ(s.looked_at(), "a");
  s.hear("b", 11'000);
  s.link.on_time(now_ms(60'000));
  EXPECT_EQ(s.looked_at(), "");
}

TEST(LinkAccepts, AListThatWaitsGoesWithItsConnection) {
  Accepting s;
  s.hear("a", 0);
  s.hear("b", 100);
  s.link.drop_connection();
  EXPECT_FALSE(s.link.accepts.deadline());
  s.link.on_time(now_ms(60'000));
  EXPECT_EQ(s.looked_at(), "a");
}

}  // namespace
}  // namespace connect_bridge::link_test
