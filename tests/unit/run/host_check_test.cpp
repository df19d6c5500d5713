// What only a look at the machine shows of a configuration.
#include "run/host_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "net/authority.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

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
              ElementsAre(HasSubstr("does not belong to the certificate"),
                          HasSubstr("has no PEM certificate"),
                          HasSubstr("audit.file: cannot write " + nowhere + ": the folder ")));
  EXPECT_THAT(found.warnings, ElementsAre(HasSubstr("status_file: cannot write " + nowhere)));
}

TEST(HostCheck, GarbageIsNoCertificate) {
  const std::string garbage = test::scratch_folder() + "garbage.crt";
  std::ofstream(garbage) << "garbage\n";
  EXPECT_THAT(
      check_host({{"tls.certificate", garbage}, {"tls.private_key", files().one + "/server.key"}})
          .problems,
      ElementsAre(HasSubstr("is not a PEM certificate")));
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
  EXPECT_THAT(check_host({{"audit.file", audit}, {"usage_file", audit}}).problems, IsEmpty());
  EXPECT_FALSE(std::filesystem::exists(audit));
  const std::string folder = test::scratch_folder();
  EXPECT_THAT(check_host({{"audit.file", folder.substr(0, folder.size() - 1)}}).problems,
              ElementsAre(HasSubstr("it is not a regular file")));
}

}  // namespace
}  // namespace connect_bridge
