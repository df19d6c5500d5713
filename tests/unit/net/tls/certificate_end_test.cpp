// A side's own certificate ends: told in time, to those who can replace it.
#include "net/tls/certificate_end.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "net/tls/tls_files.hpp"
#include "unit/net/tls/certificates.hpp"
#include "unit/net/websocket/harness.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

constexpr Stamp kDayStamp = 24 * 3600 * kStampSecond;
constexpr Stamp kEndOfIt = 20'795 * kDayStamp;  // 2026-12-08

// What is told when so many days are left, by a certificate that was not looked at before.
std::string told_with(double days_left) {
  CertificateEnd certificate("robot.local", kEndOfIt);
  const auto left = static_cast<Stamp>(days_left * static_cast<double>(kDayStamp));
  return certificate.take_line({TimePoint{}, kEndOfIt - left, 0}).value_or("");
}

TEST(CertificateEnd, IsToldFromThirtyDaysBefore) {
  EXPECT_EQ(told_with(400), "");
  EXPECT_EQ(told_with(30), "");
  EXPECT_EQ(told_with(29.9),
            "TLS: the certificate of robot.local ends in 30 days, on 2026-12-08: replace it (ctl "
            "certs)");
  EXPECT_THAT(told_with(12), HasSubstr("ends in 12 days, on 2026-12-08"));
  EXPECT_THAT(told_with(1.2), HasSubstr("ends in 1 day, on"));
  EXPECT_THAT(told_with(0.4), HasSubstr("ends in less than a day, on"));
  EXPECT_THAT(told_with(-0.4), HasSubstr("ended less than a day ago, on 2026-12-08"));
  EXPECT_THAT(told_with(-21), HasSubstr("ended 21 days ago, on"));
}

TEST(CertificateEnd, IsToldOnceADay) {
  CertificateEnd certificate("robot.local", kEndOfIt);
  const auto tells = [&](std::chrono::hours after) {
    const Duration passed = after;
    const Stamp begin = kEndOfIt - 30 * kDayStamp - 1;
    return certificate.take_line({TimePoint{} + passed, begin + passed.count(), 0}).has_value();
  };
  EXPECT_FALSE(tells(std::chrono::hours(0)));
  EXPECT_TRUE(tells(std::chrono::hours(1)));
  EXPECT_FALSE(tells(std::chrono::hours(24)));
  EXPECT_TRUE(tells(std::chrono::hours(25)));
  EXPECT_TRUE(tells(std::chrono::hours(60 * 24)));
}

TEST(CertificateEnd, OfNoneIsNeverTold) {
  CertificateEnd none;
  EXPECT_EQ(none.end(), 0);
  EXPECT_FALSE(none.take_line({TimePoint{}, kEndOfIt, 0}));
}

TEST(CertificateEnd, WithoutANameItIsThatOfThisSide) {
  CertificateEnd certificate("", kEndOfIt);
  EXPECT_THAT(certificate.take_line({TimePoint{}, kEndOfIt, 0}).value_or(""),
              HasSubstr("the certificate of this side ended"));
}

TEST(CertificateEnd, OfOneAboveItIsToldWithItsSubject) {
  CertificateEnd certificate("robot.local", kEndOfIt, "CN=Between,O=Example");
  EXPECT_EQ(certificate.take_line({TimePoint{}, kEndOfIt - 12 * kDayStamp, 0}),
            "TLS: 'CN=Between,O=Example' in the chain of the certificate of robot.local ends in 12 "
            "days, on 2026-12-08: replace the chain");
}

TEST(CertificateEnd, IsOverFromThatMomentOn) {
  const CertificateEnd certificate("robot.local", kEndOfIt);
  EXPECT_FALSE(certificate.is_over(kEndOfIt - 1));
  EXPECT_TRUE(certificate.is_over(kEndOfIt));
  EXPECT_FALSE(CertificateEnd().is_over(kEndOfIt));
  EXPECT_FALSE(CertificateEnd("robot.local", kEndOfIt, "CN=Old root").is_over(kEndOfIt));
}

// ---- with files

Now today(Duration after = {}) {
  const auto system = std::chrono::system_clock::now().time_since_epoch();
  return {TimePoint{} + after, (std::chrono::nanoseconds(system) + after).count(), 0};
}

std::string folder_of(const std::string& name) {
  const std::string folder = scratch_folder() + "end_" + name + "/";
  std::filesystem::create_directories(folder);
  return folder;
}

// A file with a certificate and that of its authority, which are valid for so many days.
Authority::Files chain_of(const std::string& folder, long days, long authority_days) {
  const Key above_key = make_key();
  const Key key = make_key();
  const Certificate above = make_certificate(above_key.get(), "Old authority", "", nullptr,
                                             above_key.get(), -9, authority_days);
  const Certificate own = make_certificate(key.get(), "robot.local", "DNS:robot.local", above.get(),
                                           above_key.get(), -9, days);
  Authority::Files files{folder + "chain.pem", folder + "chain.key.pem"};
  write_pem(files.certificate, above.get());
  const std::string second = content(files.certificate);
  write_pem(files.certificate, own.get());
  std::ofstream(files.certificate, std::ios::app) << second;
  write_pem(files.key, key.get());
  return files;
}

TEST(CertificateEnd, OfAChainTheFirstCounts) {
  const auto told = [](long days, long authority_days) {
    const auto chain = chain_of(folder_of("chain"), days, authority_days);
    TlsFiles files{{chain.certificate, chain.key}, Role::kServer};
    std::string problem;
    EXPECT_TRUE(files.get(problem)) << problem;
    EXPECT_NEAR(static_cast<double>(files.certificate().end() - today().system),
                static_cast<double>(std::min(days, authority_days) * kDayStamp), 60e9);
    return files.certificate().take_line(today()).value_or("");
  };
  const std::string above = "TLS: 'CN=Old authority' in the chain of ";
  const std::string own = "the certificate of robot.local ";
  EXPECT_THAT(told(365, 12), StartsWith(above + own + "ends in 12 days, on "));
  EXPECT_THAT(told(20, 12), StartsWith(above));
  EXPECT_THAT(told(365, -3), StartsWith(above + own + "ended 3 days ago, on "));
  EXPECT_THAT(told(12, 365), StartsWith("TLS: " + own + "ends in 12 days, on "));
  EXPECT_EQ(told(365, 365), "");
}

TEST(CertificateEnd, OfAServerIsToldAtTheStartAndWhenTheFilesAreReadAgain) {
  Authority authority{folder_of("server")};
  const auto files = authority.sign("robot.local", "IP:127.0.0.1", -1, 12);
  ListenOptions options;
  options.tls = TlsOptions{files.certificate, files.key};
  Pair pair{options};
  ASSERT_EQ(pair.problem, "");
  Network& network = pair.server.network;
  network.every_second(today());
  EXPECT_THAT(pair.server.logs,
              ElementsAre(HasSubstr("the certificate of robot.local ends in 12 days, on ")));
  EXPECT_NEAR(static_cast<double>(network.certificate_end() - today().system),
              static_cast<double>(12 * kDayStamp), 60e9);
  pair.server.logs.clear();
  network.every_second(today());
  EXPECT_THAT(pair.server.logs, IsEmpty());
  authority.sign("robot.local", "IP:127.0.0.1", -1, 5);
  for (int i = 0; i < 2; ++i) network.check_files();
  network.every_second(today());
  EXPECT_THAT(pair.server.logs, ElementsAre(HasSubstr("read again"), HasSubstr("ends in 5 days")));
  pair.server.logs.clear();
  authority.sign("robot.local", "IP:127.0.0.1", -1, 365);
  for (int i = 0; i < 2; ++i) network.check_files();
  network.every_second(today(std::chrono::hours(25)));
  EXPECT_THAT(pair.server.logs, ElementsAre(HasSubstr("read again")));
}

TEST(CertificateEnd, OfAClientIsToldIfItShowsOne) {
  Authority authority{folder_of("client")};
  Pair pair;
  DialOptions dial = pair.dial_options("wss");
  dial.tls.ca_file = authority.ca;
  EXPECT_EQ(pair.client.network.dial_problem(dial), "");
  pair.client.network.every_second(today());
  EXPECT_THAT(pair.client.logs, IsEmpty());
  EXPECT_EQ(pair.client.network.certificate_end(), 0);
  const auto own = authority.sign("operator", "DNS:operator", -9, -3);
  dial.tls.certificate_file = own.certificate;
  dial.tls.private_key_file = own.key;
  EXPECT_EQ(pair.client.network.dial_problem(dial), "");
  pair.client.network.every_second(today());
  EXPECT_THAT(pair.client.logs,
              ElementsAre(HasSubstr("the certificate of operator ended 3 days ago, on ")));
}

}  // namespace
}  // namespace connect_bridge::test
