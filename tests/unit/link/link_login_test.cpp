// As whom a peer is logged in, and until when.
#include "core/link/link_login.hpp"

#include <gtest/gtest.h>

#include <string>

#include "unit/link/script.hpp"

namespace connect_bridge::link_test {
namespace {

constexpr Stamp kSecond = 1'000'000'000;
using Expired = LinkLogin::Expired;

// By both clocks.
Now at_second(std::int64_t s) {
  Now now = now_ms(s * 1000);
  now.system = s * kSecond;
  return now;
}

Identity until(const std::string& name, Stamp second) {
  return {name, {}, second * kSecond};
}

TEST(LinkLogin, ASessionIsContinuedOnlyByItsOwnIdentity) {
  LinkLogin login;
  EXPECT_FALSE(login.is_continued_by({}, {})) << "no session";
  login.set_identity(until("anna", 0));
  login.set_session(token(kSession));
  EXPECT_TRUE(login.is_continued_by(token(kSession), until("anna", 5)));
  EXPECT_FALSE(login.is_continued_by(token(kSession), until("bert", 0)));
  EXPECT_FALSE(login.is_continued_by(token(kPeer), until("anna", 0)));
}

// The peer is nobody without its certificate, whatever the login method says.
TEST(LinkLogin, TheEarlierOfLoginAndCertificateEndsIt) {
  LinkLogin login;
  EXPECT_EQ(login.check_expiry(0, at_second(1)), Expired::kNothing);
  EXPECT_FALSE(login.deadline());
  login.set_identity(until("anna", 10));
  EXPECT_EQ(login.check_expiry(0, at_second(1)), Expired::kNothing);
  EXPECT_EQ(login.deadline(), at_second(10).steady);
  EXPECT_EQ(login.check_expiry(20 * kSecond, at_second(10)), Expired::kLogin);
  EXPECT_EQ(login.check_expiry(5 * kSecond, at_second(4)), Expired::kNothing);
  EXPECT_EQ(login.deadline(), at_second(5).steady);
  EXPECT_EQ(login.check_expiry(5 * kSecond, at_second(5)), Expired::kCertificate);
  login.set_identity(until("anna", 0));
  EXPECT_EQ(login.check_expiry(5 * kSecond, at_second(5)), Expired::kCertificate);
}

TEST(LinkLogin, ARenewalIsOneAtATimeAndNotTooOften) {
  LinkLogin login;
  EXPECT_TRUE(login.admit_renewal(at_second(0)));
  EXPECT_EQ(login.admit_renewal(at_second(0)).error().code, CloseCode::kIllegal);
  EXPECT_TRUE(login.end_renewal());
  EXPECT_FALSE(login.end_renewal());
  for (int i = 1; i < 16; ++i) {
    EXPECT_TRUE(login.admit_renewal(at_second(0)));
    login.lost();  // no answer will come
    EXPECT_FALSE(login.renewing());
  }
  EXPECT_EQ(login.admit_renewal(at_second(0)).error().code, CloseCode::kTooLarge);
  EXPECT_TRUE(login.admit_renewal(at_second(1)));
}

}  // namespace
}  // namespace connect_bridge::link_test
