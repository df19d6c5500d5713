// Files that a configuration names.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "config/config.hpp"
#include "yaml_parameters.hpp"

namespace connect_bridge {
namespace {

TEST(Config, UnreadableFilesAreNamed) {
  Surroundings around;
  around.unreadable = [](const std::string& file) {
    return file == "/b.pem" ? Failure{Cause::kFileMissing, "it is missing"} : Failure{};
  };
  const Parsed parsed = parse_config(
      yaml("{auth: {token_file: /t}, tls: {certificate: /a.pem, private_key: /b.pem}}"),
      Role::kServer, around);
  EXPECT_EQ(
      problems_text(parsed),
      "tls.private_key: \"/b.pem\" is wrong, expected a file that this program can read: it is "
      "missing\n");
}

TEST(Config, FilesThatSomebodyElseMayChangeAreRefused) {
  Surroundings around;
  around.distrusted = [](const std::string& file) {
    return file == "/t" ? "every user may change /t" : "";
  };
  const char* const files =
      "auth: {token_file: /t}\ntls: {certificate: /a.pem, private_key: /b.pem}\n";
  EXPECT_EQ(problems_text(parse_config(yaml(files), Role::kServer, around)),
            "auth.token_file: \"/t\" is wrong, expected a file that nobody else may change: every "
            "user may change /t; or strict_modes: false\n");
  const auto lax = yaml(std::string(files) + "strict_modes: false\n");
  EXPECT_EQ(problems_text(parse_config(lax, Role::kServer, around)), "");
}

TEST(Config, EachFileThatDecidesIsLookedAt) {
  std::vector<std::string> asked;
  Surroundings around;
  around.distrusted = [&](const std::string& file) {
    asked.push_back(file);
    return "";
  };
  static_cast<void>(parse_config(
      yaml("{auth: {token_file: /t, jwt_keys: /j, https_ca: /h, plugin: /p}, tls: {certificate: "
           "/c, private_key: /k, ca: /a}, listen: {relay: {token_file: /r, ca: /s}}}"),
      Role::kServer, around));
  EXPECT_THAT(asked,
              testing::UnorderedElementsAre("/t", "/j", "/h", "/p", "/c", "/k", "/a", "/r", "/s"));
}

}  // namespace
}  // namespace connect_bridge
