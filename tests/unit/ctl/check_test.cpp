// What `ctl check` and `ctl explain` print.
#include "ctl/check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include "access/login/plugin_login.hpp"
#include "unit/net/tls/certificates.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge {
namespace {

using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

struct Printed {
  int code = 0;
  std::string out, error;
};

template <class Run>
Printed printed(Run run) {
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  Printed printed;
  printed.code = run();
  printed.out = testing::internal::GetCapturedStdout();
  printed.error = testing::internal::GetCapturedStderr();
  return printed;
}

std::string file_of(const std::string& parameters, const std::string& node = "/**") {
  const std::string file = test::scratch_folder() + "checked.yaml";
  std::ofstream(file) << node << ":\n  ros__parameters:\n" << parameters;
  return file;
}

Printed check(const std::string& parameters, const std::string& role = "",
              const std::string& node = "/**") {
  const std::string file = file_of(parameters, node);
  return printed([&] { return check_file(file, role); });
}

constexpr char kToken[] = "    auth: {token: 0123456789abcdef}\n";

TEST(Check, SaysAsWhatItWasChecked) {
  const std::string client = std::string(kToken) + "    url: ws://localhost:9090/\n";
  EXPECT_THAT(check(kToken).out, StartsWith("checked as a server's file (it has no `url`); "
                                            "--role client for a client's\n"));
  EXPECT_THAT(check(client).out, StartsWith("checked as a client's file (it has a `url`); "
                                            "--role server for a server's\n"));
  EXPECT_THAT(check(client, "client").out,
              StartsWith("checked as a client's file (--role client)\n"));
  EXPECT_THAT(check(kToken, "", "connect_server").out,
              StartsWith("checked as a server's file (it is for connect_server)"));
}

// As from `ctl check <(...)`.
TEST(Check, APipeIsReadOnce) {
  const std::string pipe = test::scratch_folder() + "pipe.yaml";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  std::thread writer([&] {
    std::ofstream(pipe) << "/**:\n  ros__parameters:\n" << kToken << std::flush;
  });
  const Printed read = printed([&] { return check_file(pipe, ""); });
  writer.join();
  EXPECT_EQ(read.code, 0) << read.error;
}

TEST(Check, AMisspeltUrlIsFound) {
  const Printed wrong = check(std::string(kToken) + "    ulr: ws://localhost:9090/\n");
  EXPECT_EQ(wrong.code, 2);
  EXPECT_THAT(wrong.error, StartsWith("checked as a server's file (it has no `url`)"));
  EXPECT_THAT(wrong.error, HasSubstr("did you mean url? That is a parameter of the client"));
}

TEST(Check, TellsMistakesOfEveryKindAtOnce) {
  const std::string bad = test::scratch_folder() + "bad.pem";
  std::ofstream(bad) << "garbage\n";
  const Printed wrong =
      check(std::string(kToken) + "    listen: {port: 70000}\n" + "    tls: {certificate: " + bad +
            ", private_key: " + bad + "}\n" + "    audit: {file: /nowhere/audit.jsonl}\n");
  EXPECT_EQ(wrong.code, 2);
  EXPECT_THAT(wrong.error, HasSubstr("3 problems"));
  EXPECT_THAT(wrong.error, HasSubstr("listen.port: 70000 is wrong"));
  EXPECT_THAT(wrong.error, HasSubstr("is not a PEM certificate"));
  EXPECT_THAT(wrong.error, HasSubstr("audit.file: cannot write /nowhere/audit.jsonl"));
}

TEST(Check, ACertificateThatHasEndedIsAProblem) {
  test::Authority authority{test::scratch_folder() + "checked_"};
  const auto check_with = [&](long days) {
    const auto own = authority.sign("robot", "DNS:robot", -9, days);
    return check(std::string(kToken) + "    tls: {certificate: " + own.certificate +
                 ", private_key: " + own.key + "}\n");
  };
  const Printed soon = check_with(12);
  EXPECT_EQ(soon.code, 0) << soon.error;
  EXPECT_THAT(soon.out, HasSubstr(".cert.pem: TLS: the certificate of robot ends in 12 days, on "));
  const Printed over = check_with(-3);
  EXPECT_EQ(over.code, 2);
  EXPECT_THAT(over.error, HasSubstr(".cert.pem: TLS: the certificate of robot ended 3 days ago"));
  EXPECT_THAT(over.out, StartsWith("The rest of the file means:\n"));
  EXPECT_THAT(check_with(300).out, Not(HasSubstr("certificate of robot")));
}

TEST(Check, AKeyThatIsGivenTwiceIsRefused) {
  const Printed wrong = check(std::string(kToken) + "    rules: [a]\n    rules: []\n");
  EXPECT_EQ(wrong.code, 2);
  EXPECT_THAT(wrong.error, HasSubstr("checked.yaml:5: \"rules\" is given twice, first in line 4"));
}

// It may be root who checks somebody else's file.
TEST(Check, LoadsNoPlugin) {
  const std::string plugin = test::scratch_folder() + "plugin.so";
  const std::string mark = test::scratch_folder() + "mark";
  std::filesystem::copy_file(CONNECT_PLUGINS "marking_plugin.so", plugin);
  std::filesystem::permissions(plugin, std::filesystem::perms{0755});
  ASSERT_EQ(::setenv("ODD_MARK", mark.c_str(), 1), 0);
  const std::string login = "    auth: {method: plugin, plugin: " + plugin + "}\n";
  const Printed checked = check(login);
  EXPECT_EQ(checked.code, 0) << checked.error;
  EXPECT_THAT(checked.out, HasSubstr("auth.plugin: not loaded by ctl check\n"));
  EXPECT_FALSE(std::filesystem::exists(mark));
  std::filesystem::permissions(plugin, std::filesystem::perms{0777});
  EXPECT_THAT(check(login).error, HasSubstr("every user of this machine may change " + plugin));
  std::filesystem::permissions(plugin, std::filesystem::perms{0755});
  EXPECT_TRUE(PluginLogin::load(plugin, {}).authenticator);
  EXPECT_TRUE(std::filesystem::exists(mark)) << "a server loads it";
  ::unsetenv("ODD_MARK");
  const Printed missing = check("    auth: {method: plugin, plugin: /nowhere/plugin.so}\n");
  EXPECT_EQ(missing.code, 2);
}

TEST(Check, SendsNothing) {
  const Printed checked = check(
      "    auth: {method: jwt, jwt_keys: \"http://127.0.0.1:1/keys\", jwt_issuer: i, "
      "jwt_audience: a}\n");
  EXPECT_EQ(checked.code, 0) << checked.error;
  EXPECT_THAT(checked.out, HasSubstr("auth.jwt_keys: not loaded by ctl check\n"));
  EXPECT_THAT(checked.out, Not(HasSubstr("warning: auth")))
      << "as of an address that does not answer";
}

// ---- explain

constexpr char kRules[] =
    "    rules: [drive]\n    rule: {drive: {import_topics: [/cmd_vel], groups: [ops]}}\n";

std::string entry(const std::string& name, const std::string& rest, char digit) {
  return "- {identity: " + name + ", token_sha256: " + std::string(64, digit) + rest + "}\n";
}

Printed explained(const std::string& parameters, const std::string& identity,
                  const std::vector<std::string>& groups = {}) {
  RightQuestion question;
  question.name = "/cmd_vel";
  question.direction = Direction::kImport;
  question.who.name = identity;
  question.who.groups = groups;
  const std::string file = file_of(parameters + kRules);
  return printed([&] { return explain_file(file, "", question); });
}

TEST(Explain, AnIdentityHasTheGroupsOfTheTokenFile) {
  const std::string tokens = test::scratch_folder() + "tokens.yaml";
  std::ofstream(tokens) << entry("anna", ", groups: [ops, crew]", '1')
                        << entry("anna", ", groups: night, expires: 2020-01-31", '2')
                        << entry("bert", "", '3');
  const std::string file = "    auth: {token_file: " + tokens + "}\n";
  const Printed anna = explained(file, "anna");
  EXPECT_THAT(anna.out, StartsWith("groups of anna: [\"ops\", \"crew\", \"night\"], as " + tokens +
                                   " has it (of all 2 tokens together)\nimport ("));
  EXPECT_THAT(anna.out, HasSubstr("/cmd_vel: allowed"));
  EXPECT_EQ(anna.code, 0);
  const Printed bert = explained(file, "bert");
  EXPECT_THAT(bert.out, StartsWith("groups of bert: none, as " + tokens + " has it\nimport ("));
  EXPECT_THAT(bert.out, HasSubstr("/cmd_vel: not allowed"));
  EXPECT_EQ(bert.code, 1);
  EXPECT_THAT(explained(file, "carl").out, StartsWith("groups of carl: none given (--group); " +
                                                      tokens + " has no such identity\n"));
  EXPECT_THAT(explained(file, "bert", {"ops"}).out, StartsWith("import ("));
}

TEST(Explain, AServerHasTheGroupsBehindItsKey) {
  const std::string client =
      "    url: wss://desk.example/\n    tls: {pin: "
      "[47DEQpj8HBSa+/TImW+5JCeuQeRkm5NMpJWZG3hSuFU= desk ops]}\n";
  const Printed desk = explained(client, "desk");
  EXPECT_THAT(desk.out, StartsWith("groups of desk: [\"ops\"], as tls.pin has it\nimport ("));
  EXPECT_THAT(desk.out, HasSubstr("/cmd_vel: allowed"));
  EXPECT_THAT(explained(client, "other").out, HasSubstr("/cmd_vel: not allowed"));
}

TEST(Explain, WithoutSuchAFileItSaysThatNoGroupsWereGiven) {
  EXPECT_THAT(explained(kToken, "anna").out,
              StartsWith("groups of anna: none given (--group)\nimport ("));
  EXPECT_THAT(explained(kToken, "").out, Not(HasSubstr("groups of")));
  EXPECT_THAT(explained("    auth: {token_file: /nowhere}\n", "anna").out,
              StartsWith("groups of anna: none given (--group); "));
}

}  // namespace
}  // namespace connect_bridge
