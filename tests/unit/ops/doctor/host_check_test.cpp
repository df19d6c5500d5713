// What only a look at the machine shows of a configuration.
#include "ops/doctor/host_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "net/tls/authority.hpp"
#include "unit/net/tls/certificates.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;
using testing::IsEmpty;

auto is(Cause cause, const std::string& part) {
  return AllOf(Field(&Failure::cause, cause), Field(&Failure::text, HasSubstr(part)));
}

// Files of two authorities.
struct TwoAuthorities {
  TwoAuthorities() {
    for (const auto& name : {one, other}) {
      CertificateOrder order;
      order.folder = name;
      order.hosts = {"robot"};
      EXPECT_EQ(make_certificates(order).problem, "");
    }
  }
  const std::string one = test::scratch_folder() + "one";
  const std::string other = test::scratch_folder() + "other";
};

const TwoAuthorities& files() {
  static const TwoAuthorities made;
  return made;
}

TEST(HostCheck, TakesTlsFilesThatFit) {
  const HostFindings found = check_host({{"tls.certificate", files().one + "/server.crt"},
                                         {"tls.private_key", files().one + "/server.key"},
                                         {"tls.ca", files().one + "/ca.crt"}});
  EXPECT_THAT(found.problems, IsEmpty());
  EXPECT_THAT(found.warnings, IsEmpty());
}

TEST(HostCheck, TellsEverythingAtOnce) {
  const std::string nowhere = test::scratch_folder() + "nowhere/audit.jsonl";
  const HostFindings found = check_host({{"tls.certificate", files().one + "/server.crt"},
                                         {"tls.private_key", files().other + "/server.key"},
                                         {"tls.ca", files().one + "/server.key"},
                                         {"audit.file", nowhere},
                                         {"status_file", nowhere}});
  EXPECT_THAT(found.problems,
              ElementsAre(is(Cause::kCertificateFiles, "does not belong to the certificate"),
                          is(Cause::kCertificateFiles, "has no PEM certificate"),
                          is(Cause::kFileUnwritable,
                             "audit.file: cannot write " + nowhere + ": the folder ")));
  EXPECT_THAT(texts_of(found.warnings),
              ElementsAre(HasSubstr("status_file: cannot write " + nowhere)));
}

TEST(HostCheck, GarbageIsNoCertificate) {
  const std::string garbage = test::scratch_folder() + "garbage.crt";
  std::ofstream(garbage) << "garbage\n";
  EXPECT_THAT(
      check_host({{"tls.certificate", garbage}, {"tls.private_key", files().one + "/server.key"}})
          .problems,
      ElementsAre(is(Cause::kCertificateFiles, "is not a PEM certificate")));
}

TEST(HostCheck, TellsThatACertificateEndsOrHasEnded) {
  test::Authority authority{test::scratch_folder() + "ending_"};
  const auto found_with = [&](long days) {
    const auto own = authority.sign("robot", "DNS:robot", -9, days);
    return check_host({{"tls.certificate", own.certificate}, {"tls.private_key", own.key}});
  };
  const HostFindings soon = found_with(12);
  EXPECT_THAT(
      texts_of(soon.warnings),
      ElementsAre(HasSubstr("ending_robot.cert.pem: TLS: the certificate of robot ends in 12 "
                            "days, on ")));
  EXPECT_THAT(soon.ended, IsEmpty());
  const HostFindings over = found_with(-3);
  EXPECT_THAT(
      over.ended,
      ElementsAre(is(Cause::kCertificateExpired,
                     "ending_robot.cert.pem: TLS: the certificate of robot ended 3 days ago, "
                     "on ")));
  EXPECT_THAT(over.warnings, IsEmpty());
  EXPECT_THAT(over.problems, IsEmpty()) << "a program starts with it";
  const HostFindings later = found_with(300);
  EXPECT_THAT(later.warnings, IsEmpty());
  EXPECT_THAT(later.ended, IsEmpty());
}

// parse_config() tells it.
TEST(HostCheck, LeavesFilesThatCannotBeReadToOthers) {
  EXPECT_THAT(check_host({{"tls.certificate", std::string{"/nowhere"}},
                          {"tls.ca", std::string{"/nowhere"}}})
                  .problems,
              IsEmpty());
}

TEST(HostCheck, MakesNoFile) {
  const std::string audit = test::scratch_folder() + "host_check.jsonl";
  EXPECT_THAT(check_host({{"audit.file", audit}, {"status_file", audit}}).problems, IsEmpty());
  EXPECT_FALSE(std::filesystem::exists(audit));
  const std::string folder = test::scratch_folder();
  EXPECT_THAT(check_host({{"audit.file", folder.substr(0, folder.size() - 1)}}).problems,
              ElementsAre(is(Cause::kFileUnwritable, "it is not a regular file")));
}

TEST(HostCheck, SaysThatAFileIsMissingAndWhereItWasLookedFor) {
  EXPECT_EQ(why_unreadable("/nowhere/token"),
            (Failure{Cause::kFileMissing, "/nowhere/token is missing"}));
  EXPECT_EQ(why_unreadable("no.token").text,
            (std::filesystem::current_path() / "no.token").string() +
                " is missing (a relative path begins in the folder where the program was started)");
  const std::string file = test::scratch_folder() + "is_there";
  std::ofstream(file) << "x";
  EXPECT_FALSE(why_unreadable(file));
}

TEST(HostCheck, AParameterFileThatBecomesAPipeIsNotRead) {
  const std::string file = test::scratch_folder() + "rules.yaml";
  Config config;
  config.auth.strict_modes = true;
  EXPECT_EQ(no_longer_regular(config, {file}), "") << "its reader tells that it is missing";
  std::ofstream(file) << "x";
  EXPECT_EQ(no_longer_regular(config, {file}), "");
  std::filesystem::remove(file);
  ASSERT_EQ(::mkfifo(file.c_str(), 0600), 0);
  EXPECT_EQ(no_longer_regular(config, {file}),
            "the parameter file " + file + " is no regular file any longer");
  config.auth.strict_modes = false;
  EXPECT_EQ(no_longer_regular(config, {file}), "");
}

// Nobody but this user needs to read them. A server's token file may have hashes alone.
TEST(HostCheck, SecretsThatOthersMayRead) {
  const std::string file = test::scratch_folder() + "anna.token";
  std::ofstream(file) << "x";
  ASSERT_EQ(::chmod(file.c_str(), 0644), 0);
  const ParameterMap client{{"url", std::string("ws://robot")}, {"auth.token_file", file}};
  EXPECT_THAT(check_host(client).hints, ElementsAre(is(Cause::kFileReadable, "auth.token_file")));
  EXPECT_THAT(check_host({{"auth.token_file", file}}).hints, IsEmpty());
  ASSERT_EQ(::chmod(file.c_str(), 0600), 0);
  EXPECT_THAT(check_host(client).hints, IsEmpty());
}

TEST(HostCheck, WhereNoServerCanListen) {
  const int taken = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof at;
  ASSERT_EQ(::bind(taken, reinterpret_cast<sockaddr*>(&at), size), 0);
  ASSERT_EQ(::listen(taken, 1), 0);
  ::getsockname(taken, reinterpret_cast<sockaddr*>(&at), &size);
  ListenOptions listen;
  listen.port = ntohs(at.sin_port);
  EXPECT_THAT(why_not_listening(listen), is(Cause::kPortTaken, "127.0.0.1:"));
  ::close(taken);
  EXPECT_FALSE(why_not_listening(listen));
  listen.addresses = {"192.0.2.1"};  // of documents
  EXPECT_EQ(why_not_listening(listen).cause, Cause::kAddressNotHere);
}

TEST(HostCheck, WhereNobodyReachesAServerThatListens) {
  for (const char* here : {"127.0.0.1", "127.0.0.7", "0.0.0.0", "::", "*", "fe80::1%lo"})
    EXPECT_FALSE(why_not_reached(here)) << here;
  EXPECT_THAT(why_not_reached("192.0.2.1"), is(Cause::kAddressNotHere, "192.0.2.1"));
}

TEST(HostCheck, FindsTheUserWhoListens) {
  const std::string table = test::scratch_folder() + "tcp";
  std::ofstream(table)
      << "  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid\n"
         "   0: 0100007F:2382 0100007F:D431 01 00000000:00000000 00:00000000 00000000  1001  0 1\n"
         "   1: 0100007F:2382 00000000:0000 0A 00000000:00000000 00:00000000 00000000  1002  0 1\n";
  EXPECT_EQ(listener_at(9090, {table + ".none", table}), 1002U);
  EXPECT_EQ(listener_at(9091, {table}), std::nullopt);
}

// Root may read everything, so that a process without its rights looks.
TEST(HostCheck, SaysWhomAFileBelongsToThatIsNotPermitted) {
  const auto folder =
      std::filesystem::temp_directory_path() / ("connect_host_check_" + std::to_string(::getpid()));
  std::filesystem::create_directory(folder);
  const std::string file = folder / "token";
  std::ofstream(file) << "x";
  ASSERT_EQ(::chmod(file.c_str(), 0), 0);
  const auto look = [&] {
    if (::getuid() == 0 && ::setuid(65534) != 0) std::exit(1);
    const Failure why = why_unreadable(file);
    std::fprintf(stderr, "%s", why.text.c_str());
    std::exit(why.cause == Cause::kFileNotPermitted ? 0 : 1);
  };
  EXPECT_EXIT(look(), testing::ExitedWithCode(0),
              "^/.*/token is not permitted for user .+: it belongs to .+ .mode 0000.");
  ASSERT_EQ(::chmod(folder.c_str(), 0), 0);
  EXPECT_EXIT(look(), testing::ExitedWithCode(0),
              "^the folder /.* is not permitted for user .+: it belongs to .+ .mode 0000.");
  ASSERT_EQ(::chmod(folder.c_str(), 0700), 0);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace connect_bridge
