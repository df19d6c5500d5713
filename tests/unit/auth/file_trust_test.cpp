#include "auth/file_trust.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "unit/scratch.hpp"

namespace connect_bridge {
namespace {

using ::testing::HasSubstr;

struct FileTrust : ::testing::Test {
  const std::string folder = test::scratch_folder() + "safe";
  const std::string file = folder + "/rules.yaml";

  FileTrust() {
    std::filesystem::create_directory(folder);
    std::ofstream{file} << "rules: []";
    modes(0700, 0600);
  }
  void modes(::mode_t of_folder, ::mode_t of_file) const {
    ASSERT_EQ(::chmod(folder.c_str(), of_folder), 0);
    ASSERT_EQ(::chmod(file.c_str(), of_file), 0);
  }
};

TEST_F(FileTrust, AFileOfOursIsSafeHoweverManyMayReadIt) {
  EXPECT_EQ(who_else_may_change(file), "");
  modes(0755, 0644);
  EXPECT_EQ(who_else_may_change(file), "");
  EXPECT_EQ(who_else_may_change("/nowhere/rules.yaml"), "");
  EXPECT_EQ(who_else_may_change("/etc/passwd"), "");
}

TEST_F(FileTrust, NamesWhatEverybodyMayChangeAndTheCure) {
  modes(0700, 0602);
  EXPECT_EQ(who_else_may_change(file),
            "every user of this machine may change " + file + " (chmod go-w)");
  modes(0702, 0600);
  EXPECT_THAT(who_else_may_change(file), HasSubstr("may change the folder " + folder));
}

TEST_F(FileTrust, OthersMayWriteIntoAStickyFolder) {
  modes(01777, 0600);
  EXPECT_EQ(who_else_may_change(file), "");
}

TEST_F(FileTrust, AGroupOfOthersMayNotWrite) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root gives a file to another group";
  modes(0700, 0660);
  ASSERT_EQ(::chown(file.c_str(), 0, 12345), 0);
  EXPECT_THAT(who_else_may_change(file), HasSubstr("a group of users may change " + file));
  ASSERT_EQ(::chown(file.c_str(), 0, 0), 0);
  EXPECT_EQ(who_else_may_change(file), "") << "the group of the same name, without other members";
}

TEST_F(FileTrust, AFileOfAnotherUserIsThatUsers) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root gives a file to another user";
  ASSERT_EQ(::chown(file.c_str(), 12345, 0), 0);
  EXPECT_EQ(who_else_may_change(file), file + " belongs to the user 12345 (chown it to root)");
  ASSERT_EQ(::chown(file.c_str(), 0, 0), 0);
  ASSERT_EQ(::chown(folder.c_str(), 12345, 0), 0);
  EXPECT_THAT(who_else_may_change(file), HasSubstr("belongs to the user 12345"));
  ASSERT_EQ(::chown(folder.c_str(), 0, 0), 0);
}

TEST_F(FileTrust, LooksAtWhatALinkLeadsTo) {
  const std::string link = test::scratch_folder() + "link.yaml";
  std::filesystem::create_symlink(file, link);
  EXPECT_EQ(who_else_may_change(link), "");
  modes(0702, 0600);
  EXPECT_THAT(who_else_may_change(link), HasSubstr("may change the folder"));
}

}  // namespace
}  // namespace connect_bridge
