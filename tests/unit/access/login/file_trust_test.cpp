#include "access/login/file_trust.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/xattr.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
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

// Whoever owns a folder above it may have renamed that folder away.
TEST_F(FileTrust, AFileThatIsMissingAfterItWasReadWasReplaced) {
  EXPECT_EQ(who_else_may_have_changed(file), "");
  std::filesystem::rename(folder, folder + ".away");
  EXPECT_EQ(who_else_may_have_changed(file),
            folder + " is missing: it was replaced while it was read");
  std::filesystem::rename(folder + ".away", folder);
  modes(0700, 0602);
  EXPECT_THAT(who_else_may_have_changed(file), HasSubstr("(chmod go-w)"));
  const std::string link = test::scratch_folder() + "circle_of_one";
  std::filesystem::create_symlink("circle_of_one", link);
  EXPECT_THAT(who_else_may_have_changed(link), HasSubstr("was replaced while it was read"));
}

// As `--params-file <(...)` has it.
TEST_F(FileTrust, APipeThatWasHandedOverHasNoPath) {
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe(ends.data()), 0);
  EXPECT_EQ(who_else_may_have_changed("/proc/self/fd/" + std::to_string(ends[0])), "");
  ::close(ends[0]);
  ::close(ends[1]);
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

// As `setfacl -m u:1234:rw`: the mode then shows the rights of a private group, and no other user.
TEST_F(FileTrust, NobodyOfAnAccessListMayWrite) {
  struct Entry {
    std::uint16_t tag, rights;
    std::uint32_t id;
  };
  constexpr std::uint16_t kOwner = 1, kUser = 2, kOwnGroup = 4, kGroup = 8, kMask = 16;
  constexpr std::uint16_t kOthers = 32;
  constexpr std::uint32_t kNone = 0xffffffff;
  const auto with = [&](const std::string& path, Entry entry, std::uint16_t mask) {
    struct {
      std::uint32_t version = 2;
      std::array<Entry, 5> entries{};
    } list;
    list.entries = {Entry{kOwner, 7, kNone}, Entry{kOwnGroup, 0, kNone}, Entry{kMask, mask, kNone},
                    Entry{kOthers, 0, kNone}, entry};
    std::sort(list.entries.begin(), list.entries.end(),
              [](const Entry& one, const Entry& other) { return one.tag < other.tag; });
    return ::setxattr(path.c_str(), "system.posix_acl_access", &list, sizeof list, 0) == 0;
  };
  const Entry other{kUser, 6, 1234};
  if (!with(file, other, 6)) GTEST_SKIP() << "this file system has no access control lists";
  // Beside a private group; another group is refused without a look at the list.
  EXPECT_THAT(who_else_may_change(file), testing::AnyOf(HasSubstr("an access control list lets"),
                                                        HasSubstr("a group of users may change")));
  ASSERT_TRUE(with(file, {kGroup, 2, 1234}, 6));
  EXPECT_NE(who_else_may_change(file), "");
  for (const Entry& harmless : {Entry{kUser, 4, 1234}, Entry{kUser, 6, ::geteuid()}}) {
    ASSERT_TRUE(with(file, harmless, 4));  // the mask lets nobody write
    EXPECT_EQ(who_else_may_change(file), "");
  }
  ASSERT_TRUE(with(folder, {kUser, 7, 1234}, 7));
  EXPECT_THAT(who_else_may_change(file), HasSubstr("change the folder " + folder));
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

// link.yaml -> open/middle.yaml -> safe/rules.yaml: neither the given path nor the last one is in
// the folder where everybody may replace the link in the middle.
TEST_F(FileTrust, LooksAtEachLinkOnTheWay) {
  const std::string open = test::scratch_folder() + "open";
  const std::string link = test::scratch_folder() + "chain.yaml";
  std::filesystem::create_directory(open);
  std::filesystem::create_symlink("../safe/rules.yaml", open + "/middle.yaml");
  std::filesystem::create_symlink("open/./middle.yaml", link);
  ASSERT_EQ(::chmod(open.c_str(), 0700), 0);
  EXPECT_EQ(who_else_may_change(link), "");
  ASSERT_EQ(::chmod(open.c_str(), 0702), 0);
  EXPECT_THAT(who_else_may_change(link), HasSubstr("may change the folder " + open));
  // A link in a folder of the path.
  const std::string folder_link = test::scratch_folder() + "by_folder";
  std::filesystem::create_directory_symlink("open/folder", folder_link);
  std::filesystem::create_directory_symlink(folder, open + "/folder");
  EXPECT_THAT(who_else_may_change(folder_link + "/rules.yaml"),
              HasSubstr("may change the folder " + open));
  ASSERT_EQ(::chmod(open.c_str(), 0700), 0);
  EXPECT_EQ(who_else_may_change(folder_link + "/rules.yaml"), "");
  modes(0700, 0602);
  EXPECT_THAT(who_else_may_change(folder_link + "/rules.yaml"), HasSubstr("may change " + file));
}

TEST_F(FileTrust, LinksInACircleLeadNowhere) {
  const std::string link = test::scratch_folder() + "circle.yaml";
  std::filesystem::create_symlink("circle.yaml", link);
  EXPECT_EQ(who_else_may_change(link), "");
}

// The sticky bit keeps others from replacing what is not theirs.
TEST_F(FileTrust, ALinkOfAnotherUserInAStickyFolderIsThatUsers) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root gives a link to another user";
  const std::string sticky = test::scratch_folder() + "sticky";
  std::filesystem::create_directory(sticky);
  ASSERT_EQ(::chmod(sticky.c_str(), 01777), 0);
  const std::string link = sticky + "/link.yaml";
  std::filesystem::create_symlink(file, link);
  EXPECT_EQ(who_else_may_change(link), "");
  ASSERT_EQ(::lchown(link.c_str(), 12345, 0), 0);
  EXPECT_EQ(who_else_may_change(link),
            "the link " + link + " belongs to the user 12345 (chown -h it to root)");
}

}  // namespace
}  // namespace connect_bridge
