// A client's identity from its certificate.
#include "net/tls/certified.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "net/tls/authority.hpp"
#include "unit/net/tls/certificates.hpp"
#include "unit/net/websocket/harness.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class CertifiedTest : public testing::Test {
 protected:
  static Authority& authority() {
    static Authority made{scratch_folder() + "certified_"};
    return made;
  }
  static ListenOptions wanting(const std::string& ca) {
    const auto own = authority().sign("robot", "IP:127.0.0.1");
    ListenOptions options;
    options.tls = TlsOptions{own.certificate, own.key, ca};
    return options;
  }
  // The identity that a server gives a client with this certificate.
  static Certified shown(const Authority::Files& files, const std::string& ca = authority().ca,
                         Stamp* expires = nullptr) {
    Pair pair{wanting(ca)};
    EXPECT_EQ(pair.problem, "");
    DialOptions dial = pair.dial_options("wss");
    dial.tls.ca_file = authority().ca;
    dial.tls.certificate_file = files.certificate;
    dial.tls.private_key_file = files.key;
    EXPECT_TRUE(pair.connect(dial)) << pair.client.failures[kDial];
    if (expires) *expires = pair.server.openings.back().expires;
    return pair.server.opened.empty() ? Certified{}
                                      : pair.server.network.certified(pair.accepted());
  }
};

TEST_F(CertifiedTest, TheCommonNameIsTheIdentityAndTheOrganizationsTheGroups) {
  const std::string folder = scratch_folder() + "certified_made";
  ASSERT_EQ(make_certificates({folder, {}, {"alice"}, {"ops", "support"}, 2}).problem, "");
  const Certified alice =
      shown({folder + "/client-alice.crt", folder + "/client-alice.key"}, folder + "/ca.crt");
  ASSERT_TRUE(alice.identity) << alice.reason;
  EXPECT_EQ(alice.identity->name, "alice");
  EXPECT_THAT(alice.identity->groups, ElementsAre("ops", "support"));
  const Stamp in_two_days = (std::time(nullptr) + 2 * 86400) * std::int64_t{1'000'000'000};
  EXPECT_NEAR(static_cast<double>(alice.identity->expires), static_cast<double>(in_two_days), 60e9);
}

TEST_F(CertifiedTest, WithoutACommonNameTheFirstAlternativeOneCounts) {
  const Certified bob = shown(authority().sign("", "IP:10.0.0.1,email:bob@example.org,DNS:other"));
  ASSERT_TRUE(bob.identity) << bob.reason;
  EXPECT_EQ(bob.identity->name, "bob@example.org");
  EXPECT_THAT(shown(authority().sign("", "IP:10.0.0.1")).reason,
              HasSubstr("neither a common name"));
}

// The year 9999 is no end, but its authority has one.
TEST_F(CertifiedTest, AConnectionIsCertifiedUntilTheFirstCertificateEnds) {
  const auto days_left = [](const Stamp expires) {
    return std::lround(static_cast<double>(expires / kStampSecond - std::time(nullptr)) / 86400);
  };
  constexpr long kYear9998 = 2'900'000;
  for (const auto& [days, expected] : {std::pair{5L, 5L}, {kYear9998, 3650L}}) {
    Stamp told = 0;
    const Certified who =
        shown(authority().sign("robo", "DNS:robo", -1, days), authority().ca, &told);
    ASSERT_TRUE(who.identity) << who.reason;
    EXPECT_EQ(days_left(who.identity->expires), expected);
    EXPECT_EQ(told, who.identity->expires);
  }
  Pair plain;
  ASSERT_TRUE(plain.connect());
  EXPECT_EQ(plain.server.openings.back().expires, 0);
}

TEST_F(CertifiedTest, TooManyGroupsAreRefused) {
  for (const std::size_t count : {32U, 33U}) {
    const std::string folder = scratch_folder() + "certified_" + std::to_string(count);
    std::vector<std::string> groups;
    for (std::size_t i = 0; i < count; ++i) groups.push_back("group" + std::to_string(i));
    ASSERT_EQ(make_certificates({folder, {}, {"alice"}, groups, 2}).problem, "");
    const Certified alice =
        shown({folder + "/client-alice.crt", folder + "/client-alice.key"}, folder + "/ca.crt");
    EXPECT_EQ(alice.identity.has_value(), count == 32) << count << " " << alice.reason;
  }
}

TEST_F(CertifiedTest, WhatIsNoNameIsRefused) {
  EXPECT_FALSE(shown(authority().sign("alice\x1b[2J", "DNS:alice")).identity);
}

TEST_F(CertifiedTest, NobodyIsCertifiedWithoutACertificate) {
  Pair plain;
  ASSERT_TRUE(plain.connect());
  EXPECT_THAT(plain.server.network.certified(plain.accepted()).reason,
              HasSubstr("no certificate was shown"));
  Pair pair{wanting("")};
  DialOptions dial = pair.dial_options("wss");
  dial.tls.ca_file = authority().ca;
  ASSERT_TRUE(pair.connect(dial));
  EXPECT_FALSE(pair.server.network.certified(pair.accepted()).identity);
  EXPECT_FALSE(pair.server.network.certified({4711}).identity);
}

}  // namespace
}  // namespace connect_bridge::test
