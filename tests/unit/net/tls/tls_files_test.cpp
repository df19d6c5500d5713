// Certificates that change while the server and the client run, and servers known by their key.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "net/tls/tls_files.hpp"
#include "unit/net/tls/certificates.hpp"
#include "unit/net/tls/raw_tls.hpp"
#include "unit/no_descriptors.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge::test {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::string scratch(const std::string& name) {
  static int number = 0;
  return scratch_folder() + "files" + std::to_string(number++) + "_" + name;
}

class TlsFilesTest : public testing::Test {
 protected:
  static Authority& authority() {
    static Authority made{scratch("")};
    return made;
  }
  static Authority::Files make(const std::string& name) {
    return authority().sign(scratch_name(name), "IP:127.0.0.1,DNS:" + name);
  }
  static std::string scratch_name(const std::string& name) {
    static int number = 0;
    return name + std::to_string(number++);
  }
  static void copy(const std::string& from, const std::string& to) {
    std::filesystem::copy_file(from, to, std::filesystem::copy_options::overwrite_existing);
  }
  // What the program does in two seconds.
  void look() {
    for (int i = 0; i < 2; ++i) {
      pair.server.network.check_files();
      pair.client.network.check_files();
    }
  }
  DialOptions trusting() {
    DialOptions options = pair.dial_options("wss");
    options.tls.ca_file = authority().ca;
    return options;
  }
  // The subject of the certificate that a client sees now.
  std::string shown() {
    RawTls client{pair.server.network.listen_port(), [](SSL_CTX*) {}};
    if (!client.shakes(pair.loop)) return "no handshake";
    const Certificate seen{SSL_get1_peer_certificate(client.tls()), &X509_free};
    char name[80] = "";
    X509_NAME_get_text_by_NID(X509_get_subject_name(seen.get()), NID_commonName, name, sizeof name);
    return name;
  }
  static ListenOptions options() {
    ListenOptions made;
    copy(first.certificate, files.certificate);
    copy(first.key, files.key);
    made.tls = TlsOptions{files.certificate, files.key};
    return made;
  }

  static inline const Authority::Files files{scratch("now.crt"), scratch("now.key")};
  static inline const Authority::Files first = make("first");
  static inline const Authority::Files second = make("second");
  Pair pair{options()};
};

TEST_F(TlsFilesTest, ANewCertificateIsShownToWhoComesLaterAndDropsNobody) {
  ASSERT_TRUE(pair.connect(trusting()));
  EXPECT_THAT(shown(), HasSubstr("first"));
  copy(second.certificate, files.certificate);
  copy(second.key, files.key);
  look();
  EXPECT_THAT(shown(), HasSubstr("second"));
  EXPECT_THAT(pair.server.logs, Contains(AllOf(HasSubstr("changed and were read"),
                                               HasSubstr("CN=second"), HasSubstr("valid until"))));
  pair.client.send(kDial, "still there");
  EXPECT_TRUE(pair.loop.until([&] { return pair.server.packets(pair.accepted()) == 1; }));
  const std::size_t said = pair.server.logs.size();
  look();
  EXPECT_EQ(pair.server.logs.size(), said);
}

TEST_F(TlsFilesTest, WhatIsReplacedByRenamingIsSeen) {
  const Authority::Files third = make("third");
  std::filesystem::rename(third.certificate, files.certificate);
  std::filesystem::rename(third.key, files.key);
  look();
  EXPECT_THAT(shown(), HasSubstr("third"));
}

TEST_F(TlsFilesTest, HalfOfAChangeIsWaitedFor) {
  copy(second.certificate, files.certificate);
  pair.server.network.check_files();
  copy(second.key, files.key);
  pair.server.network.check_files();
  EXPECT_THAT(shown(), HasSubstr("first"));
  EXPECT_THAT(pair.server.logs, IsEmpty());
  pair.server.network.check_files();
  EXPECT_THAT(shown(), HasSubstr("second"));
}

TEST_F(TlsFilesTest, WrongFilesChangeNothingAndAreToldOnce) {
  copy(second.key, files.key);
  look();
  look();
  EXPECT_THAT(shown(), HasSubstr("first"));
  EXPECT_THAT(pair.server.logs,
              ElementsAre(AllOf(HasSubstr("cannot be used, the former ones stay in use"),
                                HasSubstr("does not belong to the certificate"))));
  std::filesystem::remove(files.key);
  look();
  EXPECT_THAT(pair.server.logs.back(), HasSubstr("cannot be read: No such file"));
  std::ofstream{files.certificate} << "garbage";
  look();
  EXPECT_THAT(shown(), HasSubstr("first"));
  const auto& logs = pair.server.logs;
  EXPECT_EQ(std::count_if(logs.begin(), logs.end(),
                          [](const std::string& line) {
                            return line.find("cannot be used") != std::string::npos;
                          }),
            3);
  copy(second.certificate, files.certificate);
  copy(second.key, files.key);
  look();
  EXPECT_THAT(shown(), HasSubstr("second"));
}

TEST(TlsFilesOfOthers, AreReadNeitherAtFirstNorAgain) {
  static std::string theirs;
  Authority authority{scratch("")};
  const Authority::Files own = authority.sign("own", "DNS:localhost");
  TlsOptions options{own.certificate, own.key, authority.ca};
  options.distrusted = [](const std::string& file) -> std::string {
    return file == theirs ? "somebody may change it" : "";
  };
  for (const std::string& file : {own.certificate, own.key, authority.ca}) {
    theirs = file;
    TlsFiles files(options, Role::kServer);
    std::string problem;
    EXPECT_FALSE(files.get(problem));
    EXPECT_EQ(problem, "somebody may change it");
    theirs.clear();
    EXPECT_TRUE(files.get(problem)) << problem;
    theirs = file;
    std::filesystem::last_write_time(file, std::filesystem::file_time_type::clock::now());
    TlsFiles dials = files;
    EXPECT_FALSE(dials.get_fresh(problem));
    static_cast<void>(files.check());
    const auto news = files.check();
    ASSERT_TRUE(news) << file;
    EXPECT_FALSE(news->used);
    EXPECT_THAT(news->text, HasSubstr("the former ones stay in use: somebody may change it"));
  }
}

TEST_F(TlsFilesTest, FilesThatCannotBeReadForAWhileAreReadAfterwards) {
  if (!NoDescriptors::kPossible) GTEST_SKIP() << "the sanitizer needs descriptors";
  copy(second.certificate, files.certificate);
  copy(second.key, files.key);
  {
    const NoDescriptors none;
    look();
    look();
  }
  EXPECT_THAT(shown(), HasSubstr("first"));
  EXPECT_THAT(pair.server.logs, ElementsAre(HasSubstr("Too many open files")));
  look();
  EXPECT_THAT(shown(), HasSubstr("second"));
}

TEST_F(TlsFilesTest, ANewAuthorityOfClientsHoldsForTheNextOnes) {
  ListenOptions wanting = options();
  const std::string ca = scratch("clients.pem");
  copy(authority().ca, ca);
  wanting.tls->ca_file = ca;
  Pair strict{wanting};
  DialOptions dial = strict.dial_options("wss");
  dial.tls.ca_file = authority().ca;
  const auto own = make("operator");
  dial.tls.certificate_file = own.certificate;
  dial.tls.private_key_file = own.key;
  EXPECT_TRUE(strict.connect(dial)) << strict.client.failures[kDial];
  const Authority other{scratch(""), "Other"};
  copy(other.ca, ca);
  strict.server.network.check_files();
  strict.server.network.check_files();
  EXPECT_FALSE(strict.connect(dial, {78}));
  EXPECT_FALSE(strict.server.is_closed(strict.accepted()));
}

TEST_F(TlsFilesTest, AClientReadsItsAuthorityAgain) {
  const std::string ca = scratch("ca.pem");
  const Authority other{scratch(""), "Other"};
  copy(other.ca, ca);
  DialOptions dial = trusting();
  dial.tls.ca_file = ca;
  EXPECT_FALSE(pair.connect(dial));
  copy(authority().ca, ca);
  look();
  EXPECT_TRUE(pair.connect(dial, {78})) << pair.client.failures[{78}];
  EXPECT_THAT(pair.client.logs, ElementsAre(HasSubstr("changed and were read")));
  std::ofstream{ca} << "garbage";
  look();
  EXPECT_TRUE(pair.connect(dial, {79}));
  EXPECT_THAT(pair.client.logs.back(), HasSubstr("cannot be used"));
}

TEST_F(TlsFilesTest, AClientWhoseFileWasMissingTriesItAgain) {
  DialOptions dial = trusting();
  dial.tls.ca_file = scratch("late.pem");
  EXPECT_FALSE(pair.connect(dial));
  EXPECT_THAT(pair.client.failures[kDial], HasSubstr("cannot be read"));
  EXPECT_EQ(pair.server.network.counts().accepted, 0U);
  copy(authority().ca, dial.tls.ca_file);
  EXPECT_TRUE(pair.connect(dial, {78})) << pair.client.failures[{78}];
}

// ---- pins --------------------------------------------------------------------------------------

// As `openssl pkey -pubin -outform der | openssl dgst -sha256 -binary | base64` has it.
std::string pin_of_file(const std::string& certificate) {
  std::FILE* const in = std::fopen(certificate.c_str(), "r");
  const Certificate read{PEM_read_X509(in, nullptr, nullptr, nullptr), &X509_free};
  std::fclose(in);
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned char* spki = nullptr;
  const int size = i2d_PUBKEY(X509_get0_pubkey(read.get()), &spki);
  unsigned length = 0;
  EVP_Digest(spki, static_cast<std::size_t>(size), digest, &length, EVP_sha256(), nullptr);
  OPENSSL_free(spki);
  unsigned char text[64];
  EVP_EncodeBlock(text, digest, static_cast<int>(length));
  return reinterpret_cast<const char*>(text);
}

const std::string kOtherPin = "AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA=";

TEST_F(TlsFilesTest, APinIsEnoughWithoutAnAuthority) {
  DialOptions dial = pair.dial_options("wss");  // the system's store
  dial.url.robot = "of.no.certificate";
  EXPECT_FALSE(pair.connect(dial));
  dial.tls.pins = {kOtherPin, pin_of_file(first.certificate)};
  EXPECT_TRUE(pair.connect(dial, {78})) << pair.client.failures[{78}];
}

// For the rules of a client: by the entry of its key, by an authority of one's own, or by the name
// that the certificate is for.
TEST_F(TlsFilesTest, WhoTheServerHasProvedToBe) {
  const auto proved = [&](const DialOptions& dial, std::uint32_t id) {
    EXPECT_TRUE(pair.connect(dial, {id})) << pair.client.failures[{id}];
    return pair.client.openings.back().server;
  };
  DialOptions dial = pair.dial_options("wss");
  dial.tls.pins = {kOtherPin + " other", pin_of_file(first.certificate) + " desk ops night"};
  const Identity by_key = proved(dial, 90);
  EXPECT_EQ(by_key.name, "desk");
  EXPECT_THAT(by_key.groups, ElementsAre("ops", "night"));
  dial.tls.pins = {pin_of_file(first.certificate)};
  EXPECT_EQ(proved(dial, 91).name, "");
  dial.tls.ca_file = authority().ca;
  const Identity by_certificate = proved(dial, 92);
  EXPECT_NE(by_certificate.name, "");
  EXPECT_EQ(by_certificate.expires, 0);
  DialOptions plain = trusting();
  EXPECT_EQ(proved(plain, 93).name, by_certificate.name);
}

TEST_F(TlsFilesTest, AnotherKeyIsRefusedWithThePinThatWasSeen) {
  DialOptions dial = trusting();
  dial.tls.pins = {kOtherPin};
  for (const bool with_authority : {true, false}) {
    const ConnectionId id{with_authority ? 78U : 79U};
    if (!with_authority) dial.tls.ca_file.clear();
    EXPECT_FALSE(pair.connect(dial, id));
    EXPECT_EQ(pair.client.causes[id], Cause::kOtherKey);
    EXPECT_THAT(pair.client.failures[id],
                HasSubstr("has the pin " + pin_of_file(first.certificate)));
  }
  EXPECT_TRUE(pair.server.opened.empty());
}

TEST_F(TlsFilesTest, WithAnAuthorityBothMustHold) {
  const Authority other{scratch(""), "Other"};
  DialOptions dial = trusting();
  dial.tls.pins = {pin_of_file(first.certificate)};
  EXPECT_TRUE(pair.connect(dial));
  dial.tls.ca_file = other.ca;
  EXPECT_FALSE(pair.connect(dial, {78}));
  EXPECT_EQ(pair.client.causes[{78}], Cause::kCertificateForeign);
}

TEST_F(TlsFilesTest, TheNameIsSentSoThatOneAddressMayHaveSeveral) {
  RawTls::Context context{SSL_CTX_new(TLS_client_method()), &SSL_CTX_free};
  const std::unique_ptr<SSL, decltype(&SSL_free)> tls{SSL_new(context.get()), &SSL_free};
  expect_server(tls.get(), "127.0.0.1");
  EXPECT_EQ(SSL_get_servername(tls.get(), TLSEXT_NAMETYPE_host_name), nullptr);
  expect_server(tls.get(), "robot.example");
  EXPECT_STREQ(SSL_get_servername(tls.get(), TLSEXT_NAMETYPE_host_name), "robot.example");
}

TEST_F(TlsFilesTest, ANameThatCannotBeExpectedIsNobodys) {
  RawTls::Context context{SSL_CTX_new(TLS_client_method()), &SSL_CTX_free};
  const std::unique_ptr<SSL, decltype(&SSL_free)> tls{SSL_new(context.get()), &SSL_free};
  expect_server(tls.get(), std::string("robot\0.example", 14));
  ASSERT_NE(SSL_get_verify_callback(tls.get()), nullptr);
  EXPECT_EQ(SSL_get_verify_callback(tls.get())(1, nullptr), 0);
  EXPECT_EQ(SSL_get_verify_mode(tls.get()), SSL_VERIFY_PEER);
}

}  // namespace
}  // namespace connect_bridge::test
