// What a server prints for whoever is to start the client, and where.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pwd.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "access/pairing/invitation_text.hpp"
#include "access/pairing/pairing.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

TEST(Invitation, NamesThePortWhereTheServerListens) {
  Invitation invitation{"wss://[::1]/connect", "c", "p"};
  EXPECT_THAT(invitation_text(invitation, 9090), HasSubstr("wss+pair://[::1]:9090/connect#"));
  invitation.url = "wss://robot.example:443/";
  EXPECT_THAT(invitation_text(invitation, 9090), HasSubstr("'wss+pair://robot.example:443/#"));
}

TEST(Invitation, SaysWhenAnotherPortIsDialed) {
  const auto text = [](const std::string& url) { return invitation_text({url, "c", "p"}, 9090); };
  EXPECT_THAT(
      text("wss://robot.example:443/"),
      HasSubstr("The client connects to robot.example:443, and this server listens on port 9090"));
  for (const char* same : {"wss://robot.example/", "wss://robot.example:9090/", "wss://[::1]/"})
    EXPECT_THAT(text(same), Not(HasSubstr("connects to"))) << same;
}

// The shell's history repeats it.
TEST(Invitation, ARefusedOneIsNotShownAgain) {
  Joining joining;
  joining.made_by = "server --pair";
  EXPECT_THAT(refused_invitation(joining, 4003),
              AllOf(HasSubstr("the server refused the invitation"),
                    HasSubstr("'server --pair' makes another one there")));
  for (const std::uint16_t code : {1001, 4004, 4012, 4013, 4015, 4016})
    EXPECT_EQ(refused_invitation(joining, code), "") << code;
  EXPECT_EQ(refused_invitation(joining, std::nullopt), "");
}

// In a journal, or the log of a container, others would read the code.
TEST(Invitation, IsPrintedToATerminalOnly) {
  const Invitation invitation{"wss://robot.local/", "0011223344", "p"};
  const std::string folder = test::scratch_folder() + "shown";
  const std::string file = folder + "/invitation";
  std::string problem;
  const auto print = [&](bool terminal) {
    return invitation_to_print(invitation, 9090, terminal, file, problem);
  };
  EXPECT_THAT(print(true), HasSubstr("#0011223344."));
  EXPECT_EQ(print(false), "");
  EXPECT_THAT(problem, HasSubstr("the invitation cannot be written"));
  problem.clear();
  std::filesystem::create_directory(folder);
  std::ofstream(file) << "for all to read";
  ASSERT_EQ(::chmod(file.c_str(), 0644), 0);
  EXPECT_THAT(print(false), AllOf(HasSubstr(file), Not(HasSubstr("0011223344"))));
  EXPECT_EQ(problem, "");
  EXPECT_THAT(test::content(file), HasSubstr("#0011223344."));
  using std::filesystem::perms;
  EXPECT_EQ(std::filesystem::status(file).permissions(), perms::owner_read | perms::owner_write);
}

TEST(PairingFolder, IsInTheHomeOfTheUserWhateverTheEnvironmentSays) {
  const char* const home = ::getenv("HOME");
  const std::string before = home ? home : "";
  ::unsetenv("HOME");
  const std::string path = PairingFolder("/robot").path();
  if (home) ::setenv("HOME", before.c_str(), 1);
  EXPECT_EQ(path, std::string(::getpwuid(::geteuid())->pw_dir) + "/.ros/connect_bridge/robot");
}

}  // namespace
}  // namespace connect_bridge
