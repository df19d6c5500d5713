// The certificates that `ctl certs` makes, used.
#include "net/tls/authority.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "net/tls/certified.hpp"
#include "unit/net/tls/certificates.hpp"
#include "unit/net/websocket/harness.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::string content(const std::string& file) {
  std::ostringstream text;
  text << std::ifstream{file}.rdbuf();
  return text.str();
}

template <class Kind, class Read, class Free>
std::unique_ptr<Kind, Free> read(const std::string& file, Read read_pem, Free free) {
  std::FILE* const in = std::fopen(file.c_str(), "r");
  std::unique_ptr<Kind, Free> result(read_pem(in, nullptr, nullptr, nullptr), free);
  std::fclose(in);
  return result;
}

Stamp end_in(const std::string& file) {
  return end_of(read<X509>(file, &PEM_read_X509, &X509_free).get());
}

class AuthorityTest : public testing::Test {
 protected:
  CertificateOrder order(const std::vector<std::string>& hosts,
                         const std::vector<std::string>& clients = {}) const {
    return {folder, hosts, clients, {}, 365};
  }
  [[nodiscard]] std::string file(const std::string& name) const { return folder + "/" + name; }
  static std::string new_folder() {
    static int number = 0;
    return scratch_folder() + "authority" + std::to_string(number++);
  }
  [[nodiscard]] ListenOptions server() const {
    ListenOptions options;
    options.tls = TlsOptions{file("server.crt"), file("server.key")};
    return options;
  }

  const std::string folder = new_folder();
};

TEST_F(AuthorityTest, AServerIsTrustedUnderItsNamesAndAddresses) {
  const auto made = make_certificates(order({"robot.example", "127.0.0.1", "::1"}));
  EXPECT_EQ(made.problem, "");
  EXPECT_EQ(made.shortened_to, "");
  EXPECT_THAT(made.files,
              ElementsAre(file("ca.crt"), file("ca.key"), file("server.crt"), file("server.key")));
  Pair pair{server()};
  ASSERT_EQ(pair.problem, "");
  DialOptions dial = pair.dial_options("wss");
  dial.tls.ca_file = file("ca.crt");
  EXPECT_TRUE(pair.connect(dial)) << pair.client.failures[kDial];
  dial.url.robot = "robot.example";
  EXPECT_TRUE(pair.connect(dial, {78}));
  dial.url.robot = "::1";
  EXPECT_TRUE(pair.connect(dial, {79}));
  dial.url.robot = "robot";
  EXPECT_FALSE(pair.connect(dial, {80}));
  DialOptions by_pin = pair.dial_options("wss");
  by_pin.tls.pins = {made.pin};
  EXPECT_TRUE(pair.connect(by_pin, {81})) << pair.client.failures[{81}];
}

TEST_F(AuthorityTest, AClientIsOneAndNoServer) {
  ASSERT_EQ(make_certificates(order({"127.0.0.1"}, {"alice"})).problem, "");
  ListenOptions options = server();
  options.tls->ca_file = file("ca.crt");
  Pair pair{options};
  DialOptions dial = pair.dial_options("wss");
  dial.tls.ca_file = file("ca.crt");
  EXPECT_FALSE(pair.connect(dial));
  dial.tls.certificate_file = file("client-alice.crt");
  dial.tls.private_key_file = file("client-alice.key");
  EXPECT_TRUE(pair.connect(dial, {78})) << pair.client.failures[{78}];
  ListenOptions impostor;
  impostor.tls = TlsOptions{file("client-alice.crt"), file("client-alice.key")};
  Pair fooled{impostor};
  DialOptions there = fooled.dial_options("wss");
  there.tls.ca_file = file("ca.crt");
  there.url.robot = "alice";
  EXPECT_FALSE(fooled.connect(there));
}

TEST_F(AuthorityTest, KeysAreTheOwnersAlone) {
  ASSERT_EQ(make_certificates(order({"robot"}, {"alice"})).problem, "");
  for (const char* key : {"ca.key", "server.key", "client-alice.key"}) {
    struct stat facts {};
    ASSERT_EQ(::stat(file(key).c_str(), &facts), 0) << key;
    EXPECT_EQ(facts.st_mode & 0777U, 0600U) << key;
  }
}

TEST_F(AuthorityTest, NothingIsOverwritten) {
  ASSERT_EQ(make_certificates(order({"robot"})).problem, "");
  const std::string before = content(file("server.crt")) + content(file("server.key"));
  const auto again = make_certificates(order({"robot"}, {"alice"}));
  EXPECT_THAT(again.problem, HasSubstr("exists already and is not overwritten"));
  EXPECT_THAT(again.files, IsEmpty());
  EXPECT_EQ(content(file("server.crt")) + content(file("server.key")), before);
  EXPECT_FALSE(std::filesystem::exists(file("client-alice.crt"))) << "all or nothing";
}

TEST_F(AuthorityTest, TheAuthorityThatIsThereSignsWhatIsNew) {
  ASSERT_EQ(make_certificates(order({"robot"})).problem, "");
  const std::string authority = content(file("ca.crt"));
  EXPECT_THAT(make_certificates(order({}, {"bob"})).files,
              ElementsAre(file("client-bob.crt"), file("client-bob.key")));
  EXPECT_EQ(content(file("ca.crt")), authority);
  std::filesystem::remove(file("ca.key"));
  EXPECT_THAT(make_certificates(order({}, {"carl"})).problem,
              HasSubstr("cannot be used as an authority"));
}

TEST_F(AuthorityTest, WhatItSignsEndsWithItAtTheLatest) {
  ASSERT_EQ(make_certificates(order({}, {"first"})).problem, "");
  const auto authority_of_days = [&](long days) {
    const auto key = read<EVP_PKEY>(file("ca.key"), &PEM_read_PrivateKey, &EVP_PKEY_free);
    const auto authority = read<X509>(file("ca.crt"), &PEM_read_X509, &X509_free);
    X509_gmtime_adj(X509_getm_notAfter(authority.get()), days * 24 * 3600);
    X509_sign(authority.get(), key.get(), EVP_sha256());
    write_pem(file("ca.crt"), authority.get());
  };
  authority_of_days(20);
  const Stamp last = end_in(file("ca.crt"));
  const auto made = make_certificates(order({"robot"}, {"alice"}));
  EXPECT_EQ(made.problem, "");
  EXPECT_EQ(made.shortened_to, day_of(last));
  EXPECT_EQ(end_in(file("server.crt")), last);
  EXPECT_EQ(end_in(file("client-alice.crt")), last);
  CertificateOrder shorter = order({}, {"bob"});
  shorter.days = 5;
  EXPECT_EQ(make_certificates(shorter).shortened_to, "");
  EXPECT_LT(end_in(file("client-bob.crt")), last);
  authority_of_days(-1);
  const auto late = make_certificates(order({}, {"carl"}));
  EXPECT_THAT(late.problem, HasSubstr("ca.crt has ended"));
  EXPECT_THAT(late.files, IsEmpty());
}

TEST_F(AuthorityTest, NamesAreNoPathsAndNoExtensions) {
  for (const char* host : {"robot,DNS:bank.example", "", "-robot", "a b", "robot\nx"})
    EXPECT_THAT(make_certificates(order({host})).problem, HasSubstr("neither the name of a host"));
  for (const char* client : {"../alice", "", ".alice", "a/b", "a b"})
    EXPECT_THAT(make_certificates(order({}, {client})).problem, HasSubstr("a name has 1 to 64"));
  EXPECT_THAT(make_certificates(order({})).problem, HasSubstr("name a host"));
  EXPECT_FALSE(std::filesystem::exists(folder));
}

}  // namespace
}  // namespace connect_bridge::test
