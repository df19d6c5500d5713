#include "run/unread_files.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

TEST(UnreadFiles, RefusesNewLoginsAfterTenSecondsInARow) {
  UnreadFiles unread_files;
  for (int i = 1; i < UnreadFiles::kCountMax; ++i) EXPECT_FALSE(unread_files.count(true)) << i;
  EXPECT_FALSE(unread_files.refuses_new());
  EXPECT_FALSE(unread_files.count(false));
  for (int i = 1; i < UnreadFiles::kCountMax; ++i) EXPECT_FALSE(unread_files.count(true)) << i;
  const auto begun = unread_files.count(true);
  ASSERT_TRUE(begun.has_value());
  EXPECT_EQ(begun->level, LogLevel::kError);
  EXPECT_TRUE(unread_files.refuses_new());
  EXPECT_FALSE(unread_files.count(true)) << "one line";
  const auto ended = unread_files.count(false);
  ASSERT_TRUE(ended.has_value());
  EXPECT_EQ(ended->level, LogLevel::kInfo);
  EXPECT_FALSE(unread_files.refuses_new());
}

}  // namespace
}  // namespace connect_bridge
